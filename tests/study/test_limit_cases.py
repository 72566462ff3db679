"""Limits of the literature, in both schemes: Goodman & Bray's slope, and diamonds of half-overlapped rows."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from blocksim.scenario import Document
from blocksim.scenario.models import timeline
from blocksim.study.limit import STIFFNESS, limit
from blocksim.study.run import run
from tests.study.conftest import SCENARIOS

SLOPE, WALL = SCENARIOS / "toppling_slope.toml", SCENARIOS / "tilting_wall.toml"
FRICTION = "friction.block_block"
GRAVITY = 9.81


def with_scheme(document: Document, scheme: str) -> Document:
    """Return a document with a stepping scheme, without what of [time] another one alone knows."""
    known = set(timeline.SCHEMES[scheme].model_fields) - {"step", "force_step"}
    table = document.data["time"]
    assert isinstance(table, Mapping)
    kept = {key: value for key, value in table.items() if key in known}
    return replace(document, data={**document.data, "time": {**kept, "scheme": scheme}})


# kN/m: normal forces of columns 13 on 12, 12 on 11, ... 2 on 1 at 38.15 degrees; columns 1 to 3 slide, others topple
BETWEEN_COLUMNS = [292.5, 825.7, 1556.0, 2826.7, 3922.0, 4594.8, 4837.0, 4637.0, 3978.0, 2825.5, 1413.0, 472.0]


@pytest.mark.parametrize(("scheme", "end", "within"), [("explicit", 0.001, 5e-3), ("nonsmooth", 0.5, 6e-3)])
def test_columns_about_to_topple_press_on_one_another_as_in_their_limit_equilibrium(
    scheme: str, end: float, within: float
) -> None:
    document = with_scheme(Document.read(SLOPE), scheme)
    friction = {FRICTION: "38.22 deg", "friction.block_ground": "38.22 deg"}
    kept = {"start.settle": True, "time.end": end, "time.stop_at_rest": False, "output.contacts": True}
    result = run(document.with_values({**friction, **kept, "output.every": end}).build())
    contacts = result.frames.contacts
    assert contacts is not None
    last = contacts.at(len(result.frames.time) - 1)
    joints = zip(last["body_a"], last["body_b"], last["normal_force"], strict=True)
    found = [0.0] * len(BETWEEN_COLUMNS)
    for one, other, force in joints:
        if other == one + 1 and other <= len(BETWEEN_COLUMNS):
            found[len(BETWEEN_COLUMNS) - other] += force / 1e3
    # at rest the toe holds friction that it does not need, with rigid contacts from the ninth joint on: 1 to 18 %
    known = 10 if scheme == "explicit" else 8
    assert found[:known] == pytest.approx(BETWEEN_COLUMNS[:known], rel=within)
    if scheme == "explicit":
        assert found[10:] == pytest.approx(BETWEEN_COLUMNS[10:], rel=3e-2)


def test_two_runs_confirm_the_limit_of_a_wall_on_springs_that_is_found_without_time(tmp_path: Path) -> None:
    """Wall 1 of Ferris & Tin-Loi: 32.68 degrees."""
    span = {"ground.tilt": {"from": "20 deg", "to": "40 deg"}}
    wall = with_scheme(Document.read(WALL), "explicit")
    found = limit(wall, span, out=tmp_path, keep_runs=False, stiffer=False)
    (change,) = found.limits
    assert found.runs == 2
    assert [change.low, change.high] == pytest.approx([32.68, 32.68], rel=2e-3)


def test_a_pulse_overturns_a_block_on_soft_springs_from_the_published_amplitude_on(tmp_path: Path) -> None:
    """Zhang & Makris: from 0.7362 g; on springs of a hundredth of the stiffness themselves from 0.749 g."""
    soft = {STIFFNESS: 0.01, "time.end": 7.0, "motion.start": 1.0}
    pulse = with_scheme(Document.read(SCENARIOS / "pulse.toml"), "explicit").with_values(soft)
    span = {"motion.amplitude": {"from": 7.0, "to": 7.5, "count": 2}}
    found = limit(pulse, span, stands="turned < 80 deg", tolerance=5e-3, out=tmp_path, keep_runs=False, stiffer=True)
    (answer,), given = found.changes, found.brackets[0].given  # what does not fall rocks on at the end
    assert given.low > 0.745 * GRAVITY
    assert 0.99 * 0.7362 * GRAVITY < answer.low < 0.7362 * GRAVITY < answer.high < 1.01 * 0.7362 * GRAVITY
