"""Where arrows of loads are, how long they are for one another, and when there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.scenario import scenario_from_mapping
from blocksim.simulation.results import EventRecord
from blocksim.view.arrows import FORCE, Actions, Arrows, actions_on, with_room
from blocksim.view.run_data import Support, extent_of, support_of
from tests.view.made_up import blocks_at

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from blocksim.simulation.trajectory import Frames

WIDTH, HEIGHT = 0.2, 0.4  # m
QUARTER = 0.5 * np.pi
PUSH = {"kind": "force", "name": "push", "body": "1", "magnitude": 6.0, "point": [-0.1, 0.1]}
STRONGER = {"kind": "force", "name": "pull", "body": "1", "magnitude": 12.0, "point": [0.1, 0.0]}


def acting(
    loads: Sequence[Mapping[str, object]], frames: Frames, happened: Sequence[EventRecord] = (), **tables: Any
) -> Actions:
    """Return what acts in all frames of one block."""
    return actions_on(frames, np.arange(len(frames.time)), support(loads, happened, **tables))


def support(loads: Sequence[Mapping[str, object]], happened: Sequence[EventRecord] = (), **tables: Any) -> Support:
    """Return the support of a scene with one block and these loads."""
    block = {"width": WIDTH, "height": HEIGHT, "length": 0.1, "material": "oak"}
    scene = {
        "schema": 1,
        "name": "a",
        "materials": {"oak": {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}},
        "blocks": {"brick": block},
        "bodies": [{"block": "brick", "x": 0.0, "y": 0.2, "name": "1"}],
        "loads": loads,
        **tables,
    }
    return support_of(scenario_from_mapping(scene), happened)


def block(angles: Sequence[float], x: float = 0.0) -> Frames:
    """Return a block a second apart at these angles."""
    return blocks_at(np.full(len(angles), x), 0.2, angles, size=(WIDTH, HEIGHT))


def only(found: Actions, kind: str) -> list[Arrows]:
    return [one for one in found.arrows if one.kind == kind]


def test_loads_follow_their_histories_and_are_gone_when_an_event_ends_them_or_their_body_is_removed() -> None:
    ramp = {**PUSH, "history": {"kind": "ramp", "end": 4.0}}
    frames, events = block([0.0] * 6), [{"when": "rest", "unload": ["push"]}]
    (rising,) = only(acting([ramp], frames), FORCE)
    assert rising.way[:, 0, 0] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0, 1.0])
    ended = EventRecord(event=0, step=3, time_s=3.0, what="", energy_J=0.0)
    (cut,) = only(acting([ramp], frames, [ended], events=events), FORCE)
    assert cut.way[:, 0, 0] == pytest.approx([0.0, 0.5, 1.0, 0.0, 0.0, 0.0])
    frames.vx[2:] = np.nan
    (gone,) = only(acting([PUSH], frames), FORCE)
    assert gone.way[:, 0, 0] == pytest.approx([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])


def test_marks_show_the_sum_of_coefficients_and_where_gravity_points_in_the_picture() -> None:
    loads: list[Mapping[str, object]] = [
        {"kind": "horizontal", "magnitude": -0.3},
        {"kind": "horizontal", "magnitude": 0.05},
        {"kind": "gravity", "to": "30 deg", "rate": "30 deg/s"},
    ]
    first, last = acting(loads, block([0.0, 0.0]), ground={"tilt": "0 deg"}).marks
    assert [mark.text for mark in first] == ["0.25 g", "tilt 0.00°"]
    assert [mark.text for mark in last] == ["0.25 g", "tilt 30.00°"]
    assert first[0].way == (-1.0, 0.0)
    assert first[1].way == pytest.approx((0.0, -1.0))
    assert last[1].way == pytest.approx((-0.5, -np.sqrt(0.75)))
    table = {"kind": "gravity", "to": "60 deg", "rate": "30 deg/s"}
    tilted = acting([table], block([0.0, 0.0]), ground={"tilt": "30 deg"}).marks
    assert tilted[0][0].way == pytest.approx((0.0, -1.0))  # such a picture is turned


def test_arrows_are_inside_the_picture_and_nothing_changes_without_loads() -> None:
    frames, chosen = block([0.0, QUARTER]), np.arange(2)
    loaded = support([PUSH, STRONGER])
    extent = extent_of(frames, chosen, loaded)
    found = actions_on(frames, chosen, loaded)
    room, length = with_room(extent, found)
    for lines in (one.lines(length).reshape(-1, 2) for one in found.arrows):
        assert ([room.left, room.bottom] < lines.min(axis=0)).all()
        assert (lines.max(axis=0) < [room.right, room.top]).all()
    nothing = actions_on(frames, chosen, Support())
    assert (nothing.arrows, nothing.turns, any(nothing.marks)) == ((), None, False)
    assert with_room(extent, nothing)[0] == extent
    assert nothing.explanation == ""
