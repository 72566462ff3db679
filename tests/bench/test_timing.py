"""Runs from the same state, again and again."""

import numpy as np
import pytest

from blocksim.bench.harness import Rerun, RunFailedError, three_blocks

SOFT = {"stiffness_scale": 1e-4}


def test_every_run_starts_from_the_same_state() -> None:
    scene = Rerun(three_blocks(contact=SOFT, time={"stop_at_rest": False}))
    last = round(0.3 / scene.step)
    first = scene.run(last)
    x = first.bodies.x.copy()
    assert first.scene.world.clock[0].steps == last
    assert first.seconds > 0.0
    assert x[2] > 0.12  # block 3 has fallen
    assert np.array_equal(scene.run(last).bodies.x, x)
    assert scene.run(1).bodies.x[2] < 0.061
    world = scene.scene.world
    assert scene.bytes > world.bodies.nbytes + world.pairs.nbytes + world.contacts.nbytes


def test_a_run_ends_where_the_blocks_rest() -> None:
    scene = Rerun(three_blocks(contact=SOFT))
    assert scene.run(round(2.0 / scene.step)).scene.world.clock[0].steps * scene.step < 0.5


def test_a_run_that_breaks_off_is_reported_and_not_timed() -> None:
    scene = Rerun(three_blocks(contact={**SOFT, "max_overlap": 1e-6}))
    with pytest.raises(RunFailedError, match="overlap"):
        scene.run(1000)
