"""Where the members of an ensemble end: one scenario with many sets of values, run without files."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from blocksim.errors import BlocksimError
from blocksim.scenario import Document, Scenario
from blocksim.simulation import MemberEnd, MemberFailure, run_in_batches
from blocksim.simulation.table import Columns

BATCH = 64  # members run together: enough for all cores, few enough to tell how it goes
Values = Mapping[str, object]


@dataclass(frozen=True)
class Member:
    """The end of one member: its final table, or the reason why it has none."""

    final: Columns | None
    problem: str = ""


def run_members(document: Document, values: Iterable[Values]) -> Iterator[Member]:
    """Yield where the scenario ends with each set of values (dotted key: value), in order.

    A member whose values do not go together, or whose run fails, has a problem instead of a final table; the others do
    not depend on it.
    """
    rest = iter(values)
    while batch := list(islice(rest, BATCH)):
        yield from _run_batch([_built(document, one) for one in batch])


def _built(document: Document, values: Values) -> Scenario | Member:
    try:
        return document.with_values(values).build().model_copy(update={"sweep": None})
    except BlocksimError as error:
        return Member(None, str(error).splitlines()[0])


def _run_batch(built: Sequence[Scenario | Member]) -> Iterator[Member]:
    scenarios = [one for one in built if isinstance(one, Scenario)]
    ends = (_member(one) for ended in run_in_batches(scenarios) for one in ended)
    for one in built:
        yield one if isinstance(one, Member) else next(ends)


def _member(member: MemberEnd | MemberFailure) -> Member:
    if isinstance(member, MemberFailure) or not member.outcome.is_finished:
        return Member(None, member.outcome.reason.splitlines()[0])
    return Member(member.columns)
