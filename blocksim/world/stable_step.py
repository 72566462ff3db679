"""The largest time step that a scene admits, from its stiffest contact state. One function, used everywhere.

Undamped limit. Two bodies in face contact: two springs K (normal) and k (shear) at the ends of the face. The fastest
mode of one body on a rigid plane has the squared frequency w2 = largest eigenvalue of

    [ 2k/m      2k d/m               ]      d: distance of the centre from the face
    [ 2k d/I    (2K b^2 + 2k d^2)/I  ]      b: half of the face's length

or 2K/m; the inverse masses of both bodies add, so for a pair w2 = w2_a + w2_b. The central difference scheme is stable
for w dt < 2. Faces that overlap by next to nothing, with both points at one end, are up to 10 % faster at Mindlin's
k/K = 0.82 and 29 % as k/K goes to 0; a safety of 0.05 leaves room for that.

Stiffness by tributary length (kernels/explicit/tributary.py) only lowers that of a corner: the bound holds, and a body
on several others is in all as stiff as on one.

Damping. The dashpot of a pair is implicit in the pair's own force and takes the forces of other pairs from the step
before. Alone, a pair is then stable for w dt < 2 at any damping ratio z. Where p pairs bear a body, each stands for a
piece of it (kernels/explicit/inertia.py) and sees p times the inverse mass. So pairs that act alike are one pair p
times as stiff, and stable as that at any z. Where they act against one another, the own force counts for more than it
does; the recurrence of position, velocity and lagged force is then stable for p (w dt)^2 < 2, at any z as well: a test
scans it. A thin plank on narrow seats at its ends rocks with three times the inverse mass of its pieces; and in the
models with particles pairs have the whole body each and count their own force q = max(1, p/2) times
(kernels/explicit/contact.py). Where the own force counts q times of p, the recurrence is stable up to

    z w dt = (1 - p (w dt)^2 / 4) / (2 (p - q))   (for small w dt and p = 2, 3, 4, 6: 0.5, 0.33, 0.25, 0.17)

So well beyond critical damping the step shrinks with 1/z:

    dt = safety * (2 / w) / max(1, z/2)

With safety = 0.05 impacts are resolved with w dt <= 0.1, some thirty steps, and z w dt <= 0.2. The frequency of p pairs
on one body in the mode that they share, translation, is about half of the bound w. For a dashpot that lags a step with
its own force as well, the factor would be sqrt(1 + z^2) - z: a quarter at z = 5.

Hertz. The slope of the force grows with the overlap; the deepest one expected decides. An impact at speed v of a mass m
goes to d = (5 m v^2/(4 K))^(2/5) (from m v^2/2 = 2/5 K d^(5/2)), a weight W to (W/K)^(2/3). As the step goes with
v^(-1/5), a speed that is wrong by a factor of ten changes it by 1.6 only.

Particles. The models with boundary particles spread the stiffness of a face over it; its two corners hold all of it in
the `surface` model, which is stiffer in rocking, so that its bound serves them too.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

STABILITY_LIMIT = 2.0


class ContactBody(NamedTuple):
    """Contribution of one body to the stiffest contact state; inverse masses are zero for fixed bodies."""

    size_x: float  # m
    size_y: float  # m
    inverse_mass: float  # 1/kg
    inverse_inertia: float  # 1/(kg m2)


class ContactStiffness(NamedTuple):
    """Springs and damping ratios of one pair of contact classes."""

    normal: float  # N/m
    shear: float  # N/m
    damping_ratio: float  # -, the larger of the normal and the shear one


class Load(NamedTuple):
    """Loads on the contacts of a scene, for laws whose stiffness grows with the overlap."""

    speed: float  # m/s, of the fastest impact expected
    weight: float  # N, of all free bodies


def steepest(law: str, stiffness: float, inverse_mass: float, load: Load) -> float:
    """Return the greatest slope (N/m) of the normal force that a contact of two bodies is expected to reach.

    `stiffness` as in the interaction table; `inverse_mass` (1/kg) of both bodies together.
    """
    if law == "linear" or inverse_mass == 0.0:
        return stiffness
    impact = (1.25 * load.speed**2 / (inverse_mass * stiffness)) ** 0.4
    static = (load.weight / stiffness) ** (2.0 / 3.0)
    return 1.5 * stiffness * math.sqrt(max(impact, static))


def _face_frequency_squared(half: float, distance: float, body: ContactBody, normal: float, shear: float) -> float:
    slide = 2.0 * shear * body.inverse_mass
    coupling = 2.0 * shear * distance
    rock = (2.0 * normal * half**2 + 2.0 * shear * distance**2) * body.inverse_inertia
    mixed = coupling**2 * body.inverse_mass * body.inverse_inertia
    rocking_mode = 0.5 * (slide + rock) + math.sqrt(0.25 * (slide - rock) ** 2 + mixed)
    return max(2.0 * normal * body.inverse_mass, rocking_mode)


def frequency_squared(body: ContactBody, normal: float, shear: float) -> float:
    """Return w2 (1/s2), the stiffest mode of a body that stands with one of its faces on a rigid plane."""
    half_x, half_y = 0.5 * body.size_x, 0.5 * body.size_y
    return max(
        _face_frequency_squared(half_x, half_y, body, normal, shear),
        _face_frequency_squared(half_y, half_x, body, normal, shear),
    )


def stable_step(pairs: Iterable[tuple[ContactBody, ContactBody | None, ContactStiffness]], safety: float) -> float:
    """Return the admissible step (s) of a scene; `pairs` lists every kind of contact (None: the ground).

    `safety` (-) is the share of the undamped stability limit. Returns infinity when nothing can touch anything.
    """
    step = math.inf
    for a, b, stiffness in pairs:
        squared = frequency_squared(a, stiffness.normal, stiffness.shear)
        if b is not None:
            squared += frequency_squared(b, stiffness.normal, stiffness.shear)
        if squared > 0.0:
            limit = safety * STABILITY_LIMIT / math.sqrt(squared) / max(1.0, 0.5 * stiffness.damping_ratio)
            step = min(step, limit)
    return step
