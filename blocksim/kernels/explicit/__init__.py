"""The explicit scheme: springs, dashpots and Coulomb friction at contacts, stepped by leap-frog.

Contacts push with forces that depend on overlaps and velocities, so that steps have to be a small part of the period of
the stiffest contact. A step of length dt is

    neighbours    is the list of pairs still good? else make it anew              broad_phase.py
    start         half a kick by the forces of the step before, drift             common/integrate.py
    narrow phase  the points where two bodies touch, by a contact model           models/, persistent_forces.py
    forces        a contact law, friction with history, dashpots of a pair        step.py, contact.py, laws.py
    finish        half a kick by the new forces                                   common/integrate.py
    checks        at fixed step numbers: finite, at rest, overlaps, ledger        step.py, energy.py

Threads share the bodies out (partition.py) and meet twice a step. Copies of a scene advance by the same code (step.py).
"""
