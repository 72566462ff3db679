"""The particles model: rows of discs, as bumpy as the equations make them."""

from __future__ import annotations

from math import cos, sqrt
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.shapes import to_world
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.verification.scene import HEIGHT, WIDTH, Simulation, scenario_of
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record
    from tests.kernels.explicit.models.conftest import Touch, Touching

SPACING = 1e-3
COUNT = 32  # discs along the paper's block
RAISED = SPACING * (1.0 - sqrt(0.75))  # how much deeper than face on face two interlocked rows lie
WIDE = 3.0 * WIDTH
STEP = 1e-6  # s


def centres(touching: Touching, body: Record) -> np.ndarray:
    """Return the centres (n, 2) of all discs of a body."""
    particles = touching.world.particles[body.first_particle : body.first_particle + body.particle_count]
    return np.array([to_world(body, particle.x, particle.y) for particle in particles])


def overlaps(touching: Touching) -> list[float]:
    """Return all overlaps of the discs of two blocks, by brute force."""
    a, b = (centres(touching, body) for body in touching.world.bodies[:2])
    gaps = SPACING - np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))
    return sorted(gaps[gaps > 0.0].tolist())


@given(shift=st.floats(-1.2 * WIDTH, 1.2 * WIDTH), depth=st.floats(1e-7, 4e-4), angle=st.floats(-0.8, 0.8))
def test_two_discs_touch_while_their_centres_are_nearer_than_the_diameter(
    touch: Touch, shift: float, depth: float, angle: float
) -> None:
    found = touch("particles", shift=shift, depth=depth, angle=angle)
    assert np.sort(found.points.depth) == pytest.approx(overlaps(found), abs=1e-15)
    assert np.hypot(found.points.nx, found.points.ny) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("below", [None, WIDE])
def test_interlocked_discs_touch_two_each_at_thirty_degrees(touch: Touch, below: float | None) -> None:
    shift = 0.0 if below is None else 0.5 * SPACING
    assert not touch("particles", below=below, shift=shift, depth=RAISED - 1e-7).points.size
    found = touch("particles", below=below, shift=shift, depth=RAISED + 1e-7)
    assert len(found.points) == 2 * COUNT
    slopes = np.degrees(np.arcsin(np.abs(found.points.nx)))
    assert slopes == pytest.approx(np.full(2 * COUNT, 30.0), abs=0.02)
    assert found.wrench()[0] == pytest.approx(0.0, abs=1e-18)


@given(
    width=st.floats(4e-3, 40e-3),
    below=st.floats(4e-3, 40e-3),
    shift=st.floats(-1.0, 1.0),
    depth=st.floats(1e-6, 0.3 * SPACING),
    angle=st.floats(-0.8, 0.8),
)
def test_no_two_contacts_share_a_slot(
    *, touch: Touch, width: float, below: float, shift: float, depth: float, angle: float
) -> None:
    reach = 0.5 * (width + below)
    found = touch("particles", width=width, below=below, shift=shift * reach, depth=depth, angle=angle)
    slots = found.points.slot.tolist()
    assert len(set(slots)) == len(slots)
    assert max(slots, default=0) < found.world.candidates.shape[1]
    assert found.world.contacts.shape == found.world.candidates.shape  # all of them at the same time


@pytest.mark.parametrize("tilt", [0.0, 0.3])
def test_straight_pieces_of_ground_have_no_bumps(tilt: float) -> None:
    """Discs roll on lines: a sliding block keeps its height over a profile to the stiffness of its contacts."""
    contact = {"model": "particles", "stiffness_scale": 1e-3}
    lying = {"y": HEIGHT / 2, "velocity": [0.3 * cos(tilt), 0.0]}
    profile = {"profile": [[-1.0, 0.0], [1.0, 0.0]]}
    scene = Simulation(build_world(scenario_of([lying], contact=contact, ground=profile)))
    touching = scene.to_time(2e-3).contact_records
    assert len(touching) == COUNT
    assert np.abs(touching.nx).max() < 1e-12


def test_contact_keeps_its_history_while_its_disc_begins_and_ends_to_touch_others(pace: int) -> None:
    """A block is dragged over hills and valleys at a height of its own; nothing slips, so springs only stretch."""
    contact = {"model": "particles", "restitution": 1.0}
    world = build_world(scenario_of([{"y": HEIGHT / 2}], contact=contact))
    world.interactions.static_friction = world.interactions.kinetic_friction = 1e6
    block, drag = world.bodies[0], 1e-6 * pace
    block.y -= 1.2 * RAISED
    block.vx = drag / STEP
    assert rebuild_pairs(world)
    before: dict[tuple[int, int], float] = {}
    met, parted = 0, 0
    for n in range(1200 // pace):
        block.x = n * drag
        pair_forces(world, 0, STEP)
        contacts = world.contacts[0, : world.pairs[0].active]
        now = {(int(contact.slot), int(contact.face)): float(contact.spring) for contact in contacts}
        for key, spring in now.items():
            assert abs(spring - before.get(key, 0.0)) <= 1.001 * drag, key
        met += n > 0 and len(now.keys() - before.keys()) > 0 and len(now.keys() & before.keys()) == COUNT
        parted += len(before.keys() - now.keys()) > 0 and len(now) == COUNT
        before = now
    assert (met, parted) == (1, 2)
    assert np.abs(list(before.values())).min() > 1e-4  # remembered since the disc was met
