"""Any changed bit of any frame is found, and where it is."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis.bits import differences
from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, UNITS, Frames, join_contacts
from tests.golden import Golden

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


def with_contacts(counts: Sequence[int] = (0, 2, 3, 1, 0)) -> Frames:
    """Return frames with so many contacts each, all numbers different."""
    tables = [np.zeros(count, CONTACT_ROW) for count in counts]
    for number, table in enumerate(tables):
        table["body_b"] = SUPPORT
        for column, name in enumerate(UNITS):
            table[name] = np.linspace(1.0, 2.0, len(table)) + number + 10 * column
    return replace(frames(), contacts=join_contacts(tables))


def bit_more(values: NDArray[np.float64], *place: int) -> None:
    """Change the last bit of a number."""
    values[place] = np.nextafter(values[place], np.inf)


def changed(change: Callable[[Frames], None]) -> tuple[Frames, Frames]:
    """Return frames with contacts, and others after a change."""
    other = with_contacts()
    change(other)
    return with_contacts(), other


def move(other: Frames) -> None:
    other.x[1, 0] += 0.001
    other.y[3, 2] -= 0.25
    other.angle[4, 1] += np.pi / 2


def two_bits(name: str) -> Callable[[Frames], None]:
    def change(other: Frames) -> None:
        bit_more(getattr(other, name), 2, 1)
        bit_more(getattr(other, name), 3, 0)

    return change


def of_contact(name: str) -> Callable[[Frames], None]:
    def change(other: Frames) -> None:
        assert other.contacts is not None
        table = other.contacts.at(2)
        table[name][1] = table[name][1] + 1.0 if name == "body_a" else np.nextafter(table[name][1], np.inf)

    return change


def with_zeros(sign: float) -> Frames:
    """Return frames with a zero of this sign and a NaN."""
    one = frames()
    one.x[1, 1], one.y[0, 0] = sign * 0.0, np.nan
    return one


def cut(one: Frames) -> Frames:
    """Return the first three frames."""
    names = ("step", "time", "x", "y", "angle", "vx", "vy", "spin", "contact_count", "largest_overlap")
    energy = {name: values[:3] for name, values in one.energy.items()}
    return replace(one, energy=energy, **{name: getattr(one, name)[:3] for name in names})


PAIRS = {
    "the same": changed(lambda _: None),
    **{f"last bits of {name}": changed(two_bits(name)) for name in ("x", "y", "angle", "vx", "vy", "spin")},
    "an energy": changed(lambda other: other.energy["friction"].__setitem__(4, 1.0)),
    "an energy that is not told": (frames(), replace(frames(), energy={"kinetic": frames().energy["kinetic"]})),
    "signs of zero": (with_zeros(1.0), with_zeros(-1.0)),
    "the same NaN": (with_zeros(1.0), with_zeros(1.0)),
    "places and angles of several frames": changed(move),
    "missing frames": (frames(), cut(frames())),
    **{f"last bit of a contact's {name}": changed(of_contact(name)) for name in ("normal_force", "body_a", "x")},
    "a contact more": (with_contacts(), with_contacts((0, 2, 3, 2, 0))),
    "contacts in the first alone": (with_contacts(), frames()),
    "contacts in the second alone": (frames(), with_contacts()),
}


def test_differences_are_found_where_they_are(golden: Golden) -> None:
    found = {name: differences(*pair) for name, pair in PAIRS.items()}
    golden("\n".join(f"{name}: {'none' if one.is_none else one}" for name, one in found.items()), rules=["digits"])
