"""What `blocksim limit` says of springs that give way: what they shift, and where stiff contacts have their limit."""

from collections.abc import Iterable, Mapping

from blocksim.cli.output import note
from blocksim.study.limit import LimitResult
from blocksim.study.limit_give import GIVE, gives_of, stiff_limits


def warn_of_give(searches: Iterable[LimitResult], hint: str) -> None:
    """Warn of limits that springs shift by more than GIVE."""
    for one in searches:
        for give in gives_of(one):
            if give.share > GIVE:
                turned = f"blocks have turned by {give.turn:.2g}° at {one.plan.shown(give.value)}"
                note(f"warning: {turned}, as springs give way; the limit is off by some {give.share:.1%}{hint}")


def extrapolated(found: Mapping[str, LimitResult]) -> list[str]:
    """Return a line for each limit of stiff contacts, where springs of two stiffnesses were searched."""
    plan = next(iter(found.values())).plan
    return [f"stiff contacts: {plan.shown(limit)} (extrapolated with 1/stiffness)" for limit in stiff_limits(found)]
