"""The second stepping scheme: rigid blocks, impulses, small implicit substeps.

Contact laws are Newton's restitution and Coulomb's friction, both as impulses; nothing is as stiff as the blocks, so
that steps are 0.1 to 1 ms long. A step of length dt is, in the order of step.py,

    neighbours is the list of pairs still good? else make it and its colours anew            neighbours.py
    manifolds  the contact manifold of every pair, kept for the interval                    narrow_phase.py
               which faces meet, and where they do                                          references.py, manifold.py
    cut        does an impact come first? then a shorter interval, where that may be        cuts.py
    pack       constraints that are near, four in the lanes of registers                    packs.py
    substeps   each of length h: kick, warm start, position pass, drift, velocity pass      motion.py, passes.py
               the shear impulse within the cone of friction                                passes.py
               impacts that follow from one another                                         impacts.py
    finish     impulses back to the constraints, poses and velocities to the bodies; check  motion.py, energy.py

For every contact point with the unit normal n (from body b to body a), gap s, approach J v = n (v_a - v_b) at the
point and A = J M^-1 J^T, one impulse lambda >= 0 acts along n.

Position pass (soft, J. Baumgarte's feedback with a spring and a dashpot, after E. Catto, GDC 2011):

    0 <= lambda  complementary to  J v + b s + gamma lambda >= 0,   s <= 0:  b = w / (h w + 2 zeta),
    gamma = A / (h^2 w^2 + 2 zeta w h),  w = 2 pi f / h;            s > 0:  b = 1 / h,  gamma = 0 (may just touch)

At rest (J v = 0) that is a spring: s = -gamma lambda / b = -F A / w^2 with the force F = lambda / h.

The pass leaves gaps that it has closed at zero to round-off. So s <= 0 means up to `touch_gap`, 1e-12 of the smallest
side, and an impulse is one if it moves the bodies by more than that in a substep (slip.presses).

Velocity pass: points with an impulse after the position pass, or s <= 0, have 0 <= lambda  complementary to
J v - t >= 0, with the target t = -e u where the approach u before the substep was faster than a threshold (and what
gravity does meanwhile: passes.rebound), and -max(s, 0) / h elsewhere. What the position pass adds to velocities moves
bodies, but is gone after the velocity pass.

With `contact.impacts = "sequential"` impacts that follow from one another go in rounds instead, and create no energy:
impacts.py, impact_rounds.py; and steps are cut at impacts: cuts.py.

Gravity kicks half a substep at first and whole ones then: velocities live half a substep before positions (leap-frog).
"""
