"""Any changed bit of any frame is found, and where it is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from blocksim.analysis.bits import differences
from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, UNITS, Frames, join_contacts

COUNT, BLOCKS = 5, 3


def frames(count: int = COUNT) -> Frames:
    """Return frames full of numbers that do not repeat."""
    numbers = iter(np.random.default_rng(0).normal(size=(10, count, BLOCKS)))
    step = np.arange(count)
    return Frames(
        step=step,
        time=np.multiply(step, 1e-3, dtype=np.float64),
        **{name: next(numbers) for name in ("x", "y", "angle", "vx", "vy", "spin")},
        energy={"kinetic": next(numbers)[:, 0], "friction": next(numbers)[:, 0]},
        contact_count=next(numbers)[:, 0],
        largest_overlap=next(numbers)[:, 0],
        names=("1", "2", "3"),
        size_x=np.ones(BLOCKS),
        size_y=np.ones(BLOCKS),
        start_angle=np.zeros(BLOCKS),
    )


def test_same_frames_and_contacts_do_not_differ() -> None:
    assert differences(frames(), frames()).is_none
    assert differences(with_contacts(), with_contacts()).is_none


@pytest.mark.parametrize("told", ["x_mm", "y_mm", "angle_deg", "vx_mm_s", "vy_mm_s", "spin_deg_s"])
def test_one_last_bit_is_found(told: str) -> None:
    name, unit = told.partition("_")[0], 180.0 / np.pi if "deg" in told else 1e3
    values = getattr(frames(), name)
    old = float(values[2, 1])
    values[2, 1] = values[3, 0] = np.nextafter(old, np.inf)
    first = differences(frames(), replace(frames(), **{name: values})).first
    assert first is not None
    assert (first.frame, first.time, first.block, first.quantity) == (2, 2e-3, "2", told)
    assert first.stored == pytest.approx(unit * old)


def test_energies_are_compared_and_one_that_is_no_longer_told_is_a_difference() -> None:
    other = frames()
    other.energy["friction"][4] += 1.0
    first = differences(frames(), other).first
    assert first is not None
    assert (first.frame, first.block, first.quantity) == (4, None, "friction_J")
    first = differences(frames(), replace(frames(), energy={"kinetic": frames().energy["kinetic"]})).first
    assert first is not None
    assert first.quantity == "friction_J"


def test_sign_of_zero_counts_and_equal_nan_does_not() -> None:
    zero, minus = frames(), frames()
    zero.x[1, 1], minus.x[1, 1] = 0.0, -0.0
    zero.y[0, 0] = minus.y[0, 0] = np.nan
    first = differences(zero, minus).first
    assert first is not None
    assert (first.frame, first.quantity) == (1, "x_mm")
    assert differences(zero, zero).is_none


def test_largest_difference_is_of_all_frames_in_mm_and_degrees() -> None:
    other = frames()
    other.x[1, 0] += 0.001
    other.y[3, 2] -= 0.25
    other.angle[4, 1] += np.pi / 2
    found = differences(frames(), other)
    assert found.first is not None
    assert found.first.frame == 1
    assert found.largest_mm == pytest.approx(250.0)
    assert found.largest_deg == pytest.approx(90.0)


def test_missing_frames_are_a_difference() -> None:
    short = frames()
    short = replace(
        short,
        step=short.step[:3],
        time=short.time[:3],
        **{name: getattr(short, name)[:3] for name in ("x", "y", "angle", "vx", "vy", "spin")},
        energy={name: values[:3] for name, values in short.energy.items()},
        contact_count=short.contact_count[:3],
        largest_overlap=short.largest_overlap[:3],
    )
    found = differences(frames(), short)
    assert found.frames == (COUNT, 3)
    assert found.first is None
    assert not found.is_none


def with_contacts(counts: Sequence[int] = (0, 2, 3, 1, 0)) -> Frames:
    """Return frames with so many contacts each, all numbers different."""
    tables = [np.zeros(count, CONTACT_ROW) for count in counts]
    for number, table in enumerate(tables):
        table["body_b"] = SUPPORT
        for column, name in enumerate(UNITS):
            table[name] = np.linspace(1.0, 2.0, len(table)) + number + 10 * column
    return replace(frames(), contacts=join_contacts(tables))


@pytest.mark.parametrize(("name", "told"), [("normal_force", "normal_force_N"), ("body_a", "body_a"), ("x", "x_m")])
def test_one_last_bit_of_a_contact_is_found(name: str, told: str) -> None:
    other = with_contacts()
    assert other.contacts is not None
    table = other.contacts.at(2)
    old = float(table[name][1])
    table[name][1] = new = old + 1.0 if name == "body_a" else np.nextafter(old, np.inf)
    first = differences(with_contacts(), other).first
    assert first is not None
    assert (first.frame, first.block, first.quantity) == (2, None, f"contact 2, {told}")
    assert (first.stored, first.now) == (old, new)


def test_a_contact_more_is_found() -> None:
    first = differences(with_contacts(), with_contacts((0, 2, 3, 2, 0))).first
    assert first is not None
    assert (first.frame, first.quantity, first.stored, first.now) == (3, "recorded_contacts", 1.0, 2.0)


def test_contacts_that_only_one_recording_has_are_a_difference() -> None:
    for pair in ((with_contacts(), frames()), (frames(), with_contacts())):
        first = differences(*pair).first
        assert first is not None
        assert first.quantity == "recorded_contacts"
        assert {first.stored, first.now} >= {6.0}
