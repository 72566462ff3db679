"""What pictures tell of loads besides where their arrows are: when there is none, and which way marks point."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.view.arrows import FORCE, Actions, actions_on, with_room
from blocksim.view.run_data import Support, extent_of
from tests.view.drawings import COEFFICIENTS, END, FORCES, acting, slab

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from blocksim.simulation.trajectory import Frames

PUSH = FORCES[0]
RISING = {**PUSH, "history": {"kind": "ramp", "end": 4.0}}


def actions(loads: Sequence[Mapping[str, object]], frames: Frames, **tables: Any) -> Actions:
    """Return what acts in all frames of one block."""
    return actions_on(frames, np.arange(len(frames.time)), acting(loads, **tables))


def test_loads_follow_their_histories_and_are_gone_when_an_event_ends_them_or_their_body_is_removed() -> None:
    frames = slab([0.0] * 6)
    gone = slab([0.0] * 6)
    gone.vx[2:] = np.nan
    for load, seen, tables, expected in (
        (RISING, frames, {}, [0.0, 0.25, 0.5, 0.75, 1.0, 1.0]),
        (RISING, frames, {"events": END}, [0.0, 0.5, 1.0, 0.0, 0.0, 0.0]),
        (PUSH, gone, {}, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
    ):
        (force,) = (one for one in actions([load], seen, **tables).arrows if one.kind == FORCE)
        assert force.way[:, 0, 0] == pytest.approx(expected)


def test_marks_show_where_gravity_points_in_the_picture() -> None:
    first, last = actions(COEFFICIENTS, slab([0.0, 0.0])).marks
    assert first[0].way == (-1.0, 0.0)
    assert first[1].way == pytest.approx((0.0, -1.0))
    assert last[1].way == pytest.approx((-0.5, -np.sqrt(0.75)))
    table = {"kind": "gravity", "to": "60 deg", "rate": "30 deg/s"}
    tilted = actions([table], slab([0.0, 0.0]), ground={"tilt": "30 deg"}).marks
    assert tilted[0][0].way == pytest.approx((0.0, -1.0))  # such a picture is turned


def test_arrows_are_inside_the_picture_and_nothing_changes_without_loads() -> None:
    frames, chosen, loaded = slab([0.0, 0.5 * np.pi]), np.arange(2), acting(FORCES)
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
