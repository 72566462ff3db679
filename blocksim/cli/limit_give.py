"""What `blocksim limit` says of springs that give way: what they shift, and where stiff contacts have their limit."""

from collections.abc import Callable, Iterable

from blocksim.cli.output import note
from blocksim.study.limit_give import GIVE, give_at
from blocksim.study.limit_plan import LimitPlan
from blocksim.study.limit_result import LimitResult
from blocksim.study.limit_stiff import STIFFNESS, Levels


def told_stiffness(*, silent: bool) -> Callable[[LimitPlan], None]:
    """Return what says that a limit is searched with stiffer springs."""

    def tell(plan: LimitPlan) -> None:
        note(f"springs shift this limit, or may: once more with {STIFFNESS} = {plan.apart[STIFFNESS]:g}")

    return (lambda _: None) if silent else tell


def warn_of_give(searches: Iterable[LimitResult], *, as_given: bool) -> None:
    """Warn of limits that springs shift by more than GIVE, where they are not those of stiff contacts."""
    for one in searches:
        for levels in one.levels.values():
            if levels.problem:
                note(f"warning: {_named(one, levels)}: {levels.problem}")
        for change in one.limits_as_given:
            given, give = one.levels.get(change), give_at(one, change)
            if give is not None and give.share > GIVE and (given is None or given.stiff is None):
                turned = f"blocks have turned by {give.turn:.2g}° at {one.plan.shown(give.value)}"
                hint = "leave --as-given out" if as_given else "see --stiffer"
                note(f"warning: {turned}, as springs give way; the limit is off by some {give.share:.1%}; {hint}")


def _named(one: LimitResult, levels: Levels) -> str:
    return f"limit near {one.plan.shown(levels.found[-1].middle)}, stiffness scale {levels.found[-1].scale:g}"


def level_lines(found: LimitResult, levels: Levels) -> list[str]:
    """Return a line for each stiffness at which a limit was found; nothing where it is that as given."""
    if levels.stiff is None:
        return []
    shown = found.plan.shown
    stiff = 0.5 * sum(levels.stiff)
    return [
        f"stiffness scale {one.scale:g}: {shown(one.low)} to {shown(one.high)} ({one.middle / stiff - 1.0:+.2%})"
        for one in levels.found
    ]
