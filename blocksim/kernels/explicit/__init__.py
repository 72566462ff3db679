"""The explicit scheme: springs, dashpots and Coulomb friction at contacts, stepped by velocity Verlet.

Contacts push with forces that depend on overlaps and velocities, so that steps have to be a small part of the period of
the stiffest contact. A step of length dt is

    neighbours    is the list of pairs still good? else make it anew              broad_phase.py
    kick, drift   half a step by the forces before; a step                        common/mechanics.py
    contacts      of pairs that go on touching: followed                          persistent_forces.py
                  of others: searched by a contact model; slivers of polygons     contact.py, models/, slivers.py
    forces        a law, shares of faces, dashpots, friction                      forces.py and what it imports
    kick          half a step by the new forces                                   common/mechanics.py
    checks        at fixed step numbers: finite, at rest, ledger                  step.py

step.py goes through it: where something is due between two steps, `begin_steps` makes lists, kicks and drifts;
elsewhere `move_group` does the last kick of a step and at once kick and drift of the next one, with a body at hand.
Threads share the bodies out (partition.py) and meet twice a step. Copies of a scene advance by the same code (step.py).
"""
