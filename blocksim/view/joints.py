"""Joints of a mechanism: which of them slide, and about which point the others rock.

A joint is what two bodies pressed on each other through before either of them had moved. Two sets of its points are
followed on both bodies: those where they touched then, forward to the frame that is drawn, and those where they touch
in it, back. The second set is needed because not every corner of a joint presses from the beginning: blocks that are
placed without force touch where round-off makes them, and one may open before it has pressed at its other end.

A joint slides where points that are closed are farther apart along it than a hundredth of the shorter block's shortest
side, as blocks have moved from there on. It rocks about its most closed point, of those where the bodies still touch if
they do, where they have turned against each other by a hundredth.
"""

from collections import defaultdict
from typing import NamedTuple

import numpy as np

from blocksim.simulation.contacts import SUPPORT, Contacts, Rows
from blocksim.simulation.movement import MOVED_SHARE
from blocksim.view.forces import WithContacts, contacts_of
from blocksim.view.paint import displacements
from blocksim.view.run_data import Floats, Support, shortest_sides

Pair = tuple[int, int]  # bodies a and b


class Joint(NamedTuple):
    """A joint in a frame: its points (m, scene, (k, 2)), whether it slides, and the point about which it rocks."""

    points: Floats
    slides: bool
    hinges: Floats  # (1, 2), or (0, 2) where it does not rock


class _Followed(NamedTuple):
    """Points of a joint in the frame that is drawn."""

    points: Floats  # (k, 2), on body b
    opening: Floats  # (k,), normal to the joint
    slip: Floats  # (k,), since the beginning


def joints(frames: WithContacts, frame: int, support: Support) -> list[Joint]:
    """Return the joints that slide or rock in a frame; none where no contact was recorded."""
    contacts = contacts_of(frames)
    now = _by_pair(contacts.at(frame))
    found = [
        _joint(frames, (before, frame), support, rows, now.get(pair, rows[:0]))
        for pair, (before, rows) in _at_the_start(frames, contacts, frame, support).items()
    ]
    return [one for one in found if one.slides or len(one.hinges)]


def _at_the_start(
    frames: WithContacts, contacts: Contacts, frame: int, support: Support
) -> dict[Pair, tuple[int, Rows]]:
    """Return for each joint a frame before its bodies moved, and its points then: the most that it ever had."""
    pressed = next((found for found in range(frame + 1) if len(contacts.at(found))), None)
    if pressed is None:
        return {}
    share = displacements(frames, support)[: frame + 1] / shortest_sides(frames)
    moved = np.column_stack([share > MOVED_SHARE, np.zeros(frame + 1, dtype=bool)])  # the last is the support, SUPPORT
    has_moved = np.maximum.accumulate(moved, axis=0)
    found: dict[Pair, tuple[int, Rows]] = {}
    for time in range(pressed, frame + 1):
        for pair, rows in _by_pair(contacts.at(time)).items():
            is_early = time == pressed or not has_moved[time, list(pair)].any()
            if is_early and (pair not in found or len(rows) > len(found[pair][1])):
                found[pair] = time, rows
        if has_moved[time, :-1].all():
            break
    return found


def _by_pair(rows: Rows) -> dict[Pair, Rows]:
    """Return contacts by the bodies that they are between, of those that press."""
    pairs: dict[Pair, list[int]] = defaultdict(list)
    for index, ends in enumerate(zip(rows["body_a"].tolist(), rows["body_b"].tolist(), strict=True)):
        pairs[ends].append(index)
    return {pair: rows[chosen] for pair, chosen in pairs.items() if (rows["normal_force"][chosen] > 0.0).any()}


def _joint(frames: WithContacts, times: tuple[int, int], support: Support, then: Rows, now: Rows) -> Joint:
    """Judge a joint by its points at the beginning and in the frame that is drawn."""
    pair = int(then["body_a"][0]), int(then["body_b"][0])
    least = MOVED_SHARE * min(float(shortest_sides(frames)[body]) for body in pair if body != SUPPORT)
    early = _followed(frames, times, support, then)
    # how far apart on both bodies in the first frame the points were where they touch in the second
    slip = _followed(frames, times[::-1], support, now).slip
    late = _Followed(np.stack([now["x"], now["y"]], axis=-1), -now["overlap"], slip)
    turn_a, turn_b = (_angle(frames, body, times) for body in pair)
    both = _Followed(*(np.concatenate(parts) for parts in zip(early, late, strict=True)))
    is_closed = both.opening <= least
    rocks = abs(turn_a - turn_b) > MOVED_SHARE and bool(is_closed.any())
    touching = late if len(now) else early
    hinges = touching.points[[int(np.argmin(touching.opening))]] if rocks else touching.points[:0]
    return Joint(both.points, bool((both.slip[is_closed] > least).any()), hinges)


def _followed(frames: WithContacts, times: tuple[int, int], support: Support, rows: Rows) -> _Followed:
    """Follow the points of a joint on both bodies from one frame to the other."""
    if not len(rows):
        return _Followed(np.empty((0, 2)), np.empty(0), np.empty(0))
    pair = int(rows["body_a"][0]), int(rows["body_b"][0])
    points = np.stack([rows["x"], rows["y"]], axis=-1)
    on_a, on_b = (_carried(frames, body, times, points, support) for body in pair)
    normal = np.stack([rows["normal_x"], rows["normal_y"]], axis=-1) @ _turn(frames, pair[1], times).T
    apart = on_a - on_b
    slip = np.abs(apart[:, 1] * normal[:, 0] - apart[:, 0] * normal[:, 1])
    return _Followed(on_b, (apart * normal).sum(axis=1), slip)


def _angle(frames: WithContacts, body: int, times: tuple[int, int]) -> float:
    """Return how far a body turns between two frames (rad)."""
    return 0.0 if body == SUPPORT else float(frames.angle[times[1], body] - frames.angle[times[0], body])


def _turn(frames: WithContacts, body: int, times: tuple[int, int]) -> Floats:
    """Return the matrix that turns as a body has between two frames."""
    angle = _angle(frames, body, times)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _carried(frames: WithContacts, body: int, times: tuple[int, int], points: Floats, support: Support) -> Floats:
    """Return where points (k, 2) of a body are at another frame."""
    if body == SUPPORT:
        before, after = support.offset(frames.time[list(times)])
        return np.asarray(points + after - before)
    before, after = (np.array([frames.x[time, body], frames.y[time, body]]) for time in times)
    return np.asarray((points - before) @ _turn(frames, body, times).T + after)
