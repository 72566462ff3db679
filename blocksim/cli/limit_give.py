"""What `blocksim limit` says of springs that give way and of steps: what they shift, and what is left unknown."""

from collections.abc import Callable, Iterable

from blocksim.cli.output import note
from blocksim.study.criterion import Verdict
from blocksim.study.limit_give import GIVE, give_at
from blocksim.study.limit_plan import LimitPlan
from blocksim.study.limit_result import LimitResult
from blocksim.study.limit_search import Change
from blocksim.study.limit_stiff import STEP, STIFFNESS, Levels

PERCENT = 100.0
TOLD = 1e-3  # % of a limit


def told_stiffness(*, silent: bool) -> Callable[[LimitPlan], None]:
    """Return what says that a limit is searched with stiffer springs, or half the step."""

    def tell(plan: LimitPlan) -> None:
        if STIFFNESS not in plan.apart:
            note(f"both sides once more with half the time step, {STEP} = {plan.apart[STEP]:.3g} s")
            return
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


def step_lines(found: LimitResult, change: Change[Verdict]) -> list[str]:
    """Return where a limit of rigid contacts lies with half the step, if elsewhere by more than its bracket."""
    finer, shown = found.finer.get(change), found.plan.shown
    if finer is None or (finer.low, finer.high) == (change.low, change.high):
        return [] if finer is None or not finer.problem else [f"warning: {finer.problem}"]
    moved = (finer.low + finer.high) / (change.low + change.high) - 1.0
    given = f"{shown(change.low)} to {shown(change.high)} with the step as given"
    return [f"{given}, {shown(finer.low)} to {shown(finer.high)} with half of it ({moved:+.2%}): give a shorter {STEP}"]


def margin_lines(found: LimitResult, change: Change[Verdict]) -> list[str]:
    """Return a line on what is in a bracket beyond both values that were run."""
    margin = found.margins.get(change)
    parts = {} if margin is None else {"rest speed": margin.rest, "stiffness": margin.springs}
    told = [
        f"{share:.2g} % that {name} cannot decide" for name, value in parts.items() if (share := PERCENT * value) > TOLD
    ]
    return [f"in the bracket: {' and '.join(told)}"] if told else []


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
