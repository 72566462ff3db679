"""What the events of a run have come to, as run.json and checkpoints keep it."""

from collections.abc import Iterator

from pydantic import BaseModel

from blocksim.scenario.models.events import Event, NewVelocity

LISTED = 6
"""Names of bodies that a line has; of more it has the number."""


class Happened(BaseModel, frozen=True):
    """One event that has happened."""

    event: int  # its number in the scenario, from 0
    step: int
    time_s: float  # of that step
    what: str  # in words
    energy_J: float  # noqa: N815 - taken from what the scene holds; negative where the event has brought some in


def in_words(event: Event) -> str:
    """Return what an event does."""
    return "; ".join(_parts(event))


def _parts(event: Event) -> Iterator[str]:
    for names, done in ((event.remove, "removed"), (event.fix, "fixed"), (event.free, "freed")):
        if names:
            yield f"{_listed(names)} {done}"
    if event.unload:
        yield f"{'load' if len(event.unload) == 1 else 'loads'} {', '.join(event.unload)} ended"
    if event.velocity is not None:
        yield f"{event.velocity.body} gets {_values(event.velocity)}"


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) if len(names) <= LISTED else f"{len(names)} bodies"


def _values(new: NewVelocity) -> str:
    values = (("vx", new.vx, "m/s"), ("vy", new.vy, "m/s"), ("spin", new.spin, "rad/s"))
    return ", ".join(f"{name} {value:g} {unit}" for name, value, unit in values if value is not None)
