"""Rigid contacts and impulses, long steps; contacts as a table of impulses of the last substep over its length.

Normals, arms and overlaps in the table are those with which the step that has just ended was taken. Both points of a
manifold lie on one face and share one friction impulse; it is divided as the normal ones are.
"""

from typing import Any

import numpy as np

from blocksim.kernels.nonsmooth.arrays import AWAY, Nonsmooth
from blocksim.kernels.nonsmooth.energy import NONSMOOTH_LEDGER, measure_nonsmooth
from blocksim.kernels.nonsmooth.ensemble import advance_nonsmooth_members
from blocksim.kernels.nonsmooth.step import advance_nonsmooth, advance_nonsmooth_in_team
from blocksim.simulation.contacts import SUPPORT, Rows, empty_rows
from blocksim.simulation.schemes.scheme import Scheme
from blocksim.world.nonsmooth import NONSMOOTH as CONSTRUCTION
from blocksim.world.nonsmooth import threads_of, with_more_constraints, with_more_threads


def nonsmooth_contacts(scene: Nonsmooth, blocks: int) -> Rows:
    """Return all points that press, those of a manifold beside one another; bodies from `blocks` on are the support."""
    stepping = scene.contacts.stepping[0]
    manifolds = scene.contacts.constraints[: int(stepping.constraint_count)]
    manifolds = manifolds[manifolds["reach"] != AWAY]
    points = np.stack([_points(scene, manifolds, "one", 0.0), _points(scene, manifolds, "two", 1.0)], axis=-1).ravel()
    rows = points[points["normal_force"] > 0.0]
    for name in ("normal_force", "shear_force"):
        rows[name] /= float(stepping.substep)
    rows["body_b"][rows["body_b"] >= blocks] = SUPPORT
    return rows


def _points(scene: Nonsmooth, manifolds: Any, which: str, along: float) -> Rows:
    """Return one point of every manifold, with impulses (N s); `along` counts widths from point one."""
    nx, ny = manifolds["nx"], manifolds["ny"]
    body = scene.world.bodies[manifolds["a"]]
    above, beside = manifolds["shear_arm_a"], along * manifolds["width"] - manifolds["arm_a"]
    normal, total = manifolds[f"normal_{which}"], manifolds["normal_one"] + manifolds["normal_two"]
    rows = empty_rows(len(manifolds))
    rows["body_a"], rows["body_b"] = manifolds["a"], manifolds["b"]
    rows["x"], rows["y"] = body["x"] + above * nx - beside * ny, body["y"] + above * ny + beside * nx
    rows["normal_x"], rows["normal_y"] = nx, ny
    rows["overlap"] = -manifolds[f"gap_{which}"]
    rows["normal_force"] = normal
    rows["shear_force"] = manifolds["shear"] * np.divide(normal, total, out=np.zeros_like(total), where=total > 0.0)
    return rows


RIGID = "nonsmooth"  # set of machine code

NONSMOOTH = Scheme(
    name="nonsmooth",
    scene_type=Nonsmooth,
    ledger=NONSMOOTH_LEDGER,
    least_bodies=100,  # two threads on 100 blocks gain nothing, on 200 they are 1.2 to 1.4 times as fast
    construction=CONSTRUCTION,
    advance=advance_nonsmooth,
    advance_in_team=advance_nonsmooth_in_team,
    advance_members=advance_nonsmooth_members,
    with_more_room=with_more_constraints,
    with_threads=with_more_threads,
    threads_of=threads_of,
    for_another_thread=lambda scene: scene,  # rows are solved in registers
    contacts=nonsmooth_contacts,
    measure=measure_nonsmooth,
    kernels=lambda _: RIGID,
)
