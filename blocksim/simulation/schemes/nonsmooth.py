"""Rigid contacts and impulses, long steps; contacts as a table of impulses of the last substep over its length.

Normals, arms and overlaps in the table are those with which the step that has just ended was taken. Both points of a
manifold lie on one face and share one friction impulse; it is divided as the normal ones are.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import REMOVED, Records
from blocksim.kernels.nonsmooth import arrays, energy, step
from blocksim.simulation import schemes, trajectory
from blocksim.world import nonsmooth, rigid_step, sag

Floats = NDArray[np.float64]


def nonsmooth_contacts(scene: arrays.Nonsmooth, blocks: int) -> trajectory.Rows:
    """Return all points that press, those of a manifold beside one another; bodies from `blocks` on are the support."""
    stepping = scene.contacts.stepping[0]
    manifolds = scene.contacts.constraints.view(np.ndarray)[: int(stepping.constraint_count)]  # fields of records: slow
    manifolds = manifolds[manifolds["reach"] != arrays.AWAY]
    points = np.stack([_points(scene, manifolds, "one", 0.0), _points(scene, manifolds, "two", 1.0)], axis=-1).ravel()
    rows = points[points["normal_force"] > 0.0]
    for name in ("normal_force", "shear_force"):
        rows[name] /= float(stepping.substep)
    rows["body_b"][rows["body_b"] >= blocks] = trajectory.SUPPORT
    return rows


def _points(scene: arrays.Nonsmooth, manifolds: Any, which: str, along: float) -> trajectory.Rows:
    """Return one point of every manifold, with impulses (N s); `along` counts widths from point one."""
    nx, ny = manifolds["nx"], manifolds["ny"]
    body = scene.world.bodies.view(np.ndarray)[manifolds["a"]]
    above, beside = manifolds["shear_arm_a"], along * manifolds["width"] - manifolds["arm_a"]
    normal, total = manifolds[f"normal_{which}"], manifolds["normal_one"] + manifolds["normal_two"]
    rows = np.zeros(len(manifolds), trajectory.CONTACT_ROW)
    rows["body_a"], rows["body_b"] = manifolds["a"], manifolds["b"]
    rows["x"], rows["y"] = body["x"] + above * nx - beside * ny, body["y"] + above * ny + beside * nx
    rows["normal_x"], rows["normal_y"] = nx, ny
    rows["overlap"] = -manifolds[f"gap_{which}"]
    rows["normal_force"] = normal
    rows["shear_force"] = manifolds["shear"] * np.divide(normal, total, out=np.zeros_like(total), where=total > 0.0)
    return rows


def renew(scene: arrays.Nonsmooth, old: Records) -> bool:
    """Bring states and constraints up to date with bodies that an event has changed; `old` are these before.

    All velocities begin anew half a substep back, as those at the start of a run do: what was held falls from now on.
    The correction in the ledger stays what it is.
    """
    bodies, states, before = scene.world.bodies, scene.contacts.states, scene.contacts.before
    controls, h = scene.world.controls[0], float(scene.contacts.stepping[0].substep)
    hx, hy = h * float(controls.gravity_x), h * float(controls.gravity_y)
    was_free, is_free = old["inverse_mass"] > 0.0, bodies["inverse_mass"] > 0.0
    shown = old["vx"] ** 2 + old["vy"] ** 2
    ahead = (states["vx"] + 0.5 * hx) ** 2 + (states["vy"] + 0.5 * hy) ** 2
    kept = np.where(was_free, before["lifted"] - states["vx"] * hx - states["vy"] * hy + 0.5 * (ahead - shown), 0.0)
    for name in ("inverse_mass", "inverse_inertia", "spin"):
        states[name] = bodies[name]
    states["vx"] = bodies["vx"] - np.where(is_free, 0.5 * hx, 0.0)
    states["vy"] = bodies["vy"] - np.where(is_free, 0.5 * hy, 0.0)
    before["lifted"] = np.where(is_free, kept + states["vx"] * hx + states["vy"] * hy, before["lifted"])
    for name in RATES:
        before[name] = states[name]
    listed = scene.contacts.constraints[: int(scene.contacts.stepping[0].constraint_count)]
    is_gone = np.any([old[name] != bodies[name] for name in ("x", "y", "angle")], axis=0)
    is_gone |= bodies["is_moved"] == REMOVED
    is_gone = is_gone[listed["a"]] | is_gone[listed["b"]]
    for name in ("normal_one", "normal_two", "shear"):
        listed[name][is_gone] = 0.0
    listed["reach"][is_gone] = arrays.AWAY
    return False


def halt(scene: arrays.Nonsmooth, count: int) -> None:
    """Take their velocities from the first bodies."""
    for name in RATES:
        scene.contacts.states[name][:count] = 0.0


def begin(scene: arrays.Nonsmooth) -> None:
    """Let the first substep begin with the impulses that hold against gravity, and clear the books."""
    contacts = scene.contacts
    for books in (contacts.tallies, scene.pushes):
        for name in books.dtype.names or ():
            books[name] = 0.0
    for name in ("sweeps", *CONVERGENCE.values()):
        contacts.stepping[name] = 0
    contacts.stepping["is_settled"] = 1


def unrest(scene: arrays.Nonsmooth, is_free: NDArray[np.bool_], change: Floats, side: float, _scale: float) -> float:
    """Return how far free blocks have moved in a step, over that at rest, as a share of gravity and loads."""
    ways = schemes.corner_ways(change, scene.world.bodies["radius"][: is_free.size])
    return STILL_BALANCE * float(ways[is_free].max()) / (SETTLING.call * STILL * side)


def overlaps_of_constraints(scene: arrays.Nonsmooth) -> schemes.Overlaps:
    """Return how deep bodies overlap, over their smallest sides unless contact.max_overlap is judged by."""
    constraints = scene.contacts.constraints[: int(scene.contacts.stepping[0].constraint_count)]
    depth = np.maximum(-constraints["gap_one"], -constraints["gap_two"])
    limit = np.ones(constraints.size)
    if not scene.world.controls[0].max_overlap > 0.0:
        widths = scene.world.bodies["least_width"]
        limit = np.minimum(widths[constraints["a"]], widths[constraints["b"]])
    return schemes.Overlaps(
        constraints["a"], constraints["b"], np.where(constraints["reach"] == arrays.TOUCHING, depth, 0.0), limit
    )


def late_contact(scene: arrays.Nonsmooth, overlaps: schemes.Overlaps) -> str:
    """Return that the step is too long where two blocks at its greatest safe speed do not come as deep; else nothing.

    The limits of speed from before the start are left where heavy blocks drive light ones to and fro: what is struck in
    a step moves on with its new velocity until contacts are found again. Stiffness is in proportion to 1/step squared.
    """
    step, deepest = float(scene.world.controls[0].step), float(np.nanmax(overlaps.depth))
    way = rigid_step.SHARE * float(scene.world.bodies["least_width"].min())
    if not deepest > 2.0 * way:
        return ""
    return (
        f"an overlap is as deep as one step takes at {deepest / step:.3g} m/s, while {way / step:.3g} m/s are safe: "
        "blocks became faster than foreseen, or light ones give way under heavy ones; shorten time.step to "
        f"{step * way / deepest:.2g} s or less"
    )


def convergence(scene: arrays.Nonsmooth, member: int = 0) -> dict[str, float]:
    """Return how well impulses were found so far in a scene, or in a member of a stack."""
    stepping = scene.contacts.stepping.reshape(-1)[member]
    return {name: stepping[entry].item() for name, entry in CONVERGENCE.items()}


CONVERGENCE = {  # entry of run.json, and where the kernels count it
    "passes": "passes",
    "unsolved": "unsolved",
    "last_change_m_s": "residual",
    "largest_change_m_s": "worst_residual",
    "cut_rounds": "cut_rounds",
    "cut_searches": "cut_searches",
}
RATES = ("vx", "vy", "spin")
STILL = 1e-10  # of the smallest side of a block: way in a step at rest
STILL_BALANCE = 1e-8  # what that counts as, beside accelerations over gravity
SETTLING = schemes.SettlingSteps(call=2, part=40, most=40_000, least_share=0.01)
RIGID, OF_OUTLINES = "nonsmooth", "outlines"  # sets of machine code
IN_ROUNDS = {RIGID: "nonsmooth-in-rounds", OF_OUTLINES: "outlines-in-rounds"}  # where impacts follow from one another
PLAIN: dict[str, object] = {"time": {"scheme": RIGID}}
ROUNDS: dict[str, object] = {"time": {"scheme": RIGID}, "contact": {"impacts": "sequential"}}
POLYGON = {"any": {"sides": 4, "radius": 0.5, "depth": 1.0, "material": "any"}}

NONSMOOTH = schemes.Scheme(
    name="nonsmooth",
    scene_type=arrays.Nonsmooth,
    construction=nonsmooth.NONSMOOTH,
    advance=step.advance_nonsmooth,
    advance_in_team=step.advance_nonsmooth_in_team,
    advance_members=step.advance_nonsmooth_members,
    least_bodies=schemes.BODIES_A_THREAD,
    with_more_room=nonsmooth.with_more_constraints,
    with_threads=lambda scene, threads: scene._replace(
        contacts=scene.contacts._replace(residuals=np.zeros((2, nonsmooth.LINE_WORDS * threads)))
    ),
    threads_of=lambda scene: int(scene.contacts.residuals.shape[1]) // nonsmooth.LINE_WORDS,
    after_event=renew,
    kernels=lambda _: RIGID,
    of_outlines={RIGID: OF_OUTLINES},
    kernel_variant=lambda kernels, scenario: (
        IN_ROUNDS[kernels] if nonsmooth.has_sequential_impacts(scenario) else kernels
    ),
    kernel_sets={
        RIGID: PLAIN,
        OF_OUTLINES: {**PLAIN, "blocks": POLYGON},
        IN_ROUNDS[RIGID]: ROUNDS,
        IN_ROUNDS[OF_OUTLINES]: {**ROUNDS, "blocks": POLYGON},
    },
    settling=SETTLING,
    halt=halt,
    begin=begin,
    unrest=unrest,
    ledger=energy.NONSMOOTH_LEDGER,
    measure=energy.measure_nonsmooth,
    contacts=nonsmooth_contacts,
    overlaps=overlaps_of_constraints,
    lost_contact=late_contact,
    convergence=convergence,
    warning=lambda scene, overlap, side: sag.overlap_warning(overlap, sag.current_crush_depth(scene), side),
)
