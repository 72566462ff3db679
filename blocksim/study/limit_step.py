"""The limits of rigid contacts once more with half the time step: what the step shifts shows as the way that they move.

Steps of rigid contacts are chosen before a run, and what they take away from a limit goes with the step, as blocks turn
about edges that move on by v h in a step h. So both sides of a bracket are run with half of it. Where they come to the
same, the limit is that of any shorter step, within its bracket; where they do not, it is searched again, and the answer
holds both brackets, and beyond the second one as much as lies between them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from blocksim.scenario import Scenario
from blocksim.simulation.schemes import build
from blocksim.study.criterion import Verdict
from blocksim.study.limit_plan import LimitPlan
from blocksim.study.limit_result import BOTH, Finer, LimitResult, fallen
from blocksim.study.limit_search import Change, Number, changes_in, next_near
from blocksim.study.limit_stiff import STEP
from blocksim.study.rows import Row

HALF = 0.5
NOT_FOUND = "with half the time step there is no such limit in the range"
Choose = Callable[[Mapping[Number, Verdict]], list[Number]]
Search = Callable[[LimitPlan, Choose], dict[Number, Row]]


@dataclass(frozen=True)
class Halving:
    """The limits of a search, as they are with half the step; `on_step` is called before the first of these runs."""

    found: LimitResult
    search: Search
    on_step: Callable[[LimitPlan], None]

    def complete(self) -> LimitResult:
        """Return the result with these limits."""
        if not has_rigid_contacts(self.found.plan):
            return self.found
        rows: dict[float, dict[Number, Row]] = {}
        finer = {one: self._finer(one, rows) for one in self.found.falls_as_given}
        return replace(self.found, finer=finer, finer_rows=rows)

    def _finer(self, change: Change[Verdict], rows: dict[float, dict[Number, Row]]) -> Finer:
        plan, sides = self.found.plan, fallen({change.low: change.below, change.high: change.above})
        step = HALF * min(step_of(plan.scenario_at(value)) for value in sides)
        near = Change(change.low, change.high, sides[change.low], sides[change.high])
        finer = replace(plan, apart={STEP: step})
        if step not in rows:
            self.on_step(finer)
        found = self.search(finer, lambda known: next_near(plan.span, fallen(known), near, plan.tolerance))
        rows.setdefault(step, {}).update(found)
        changes = changes_in(fallen({value: plan.criterion.verdict(row) for value, row in found.items()}))
        (first, *others) = changes or [near]
        if others or not changes or {first.below, first.above} != BOTH:
            return Finer(step, change.low, change.high, NOT_FOUND)
        return Finer(step, first.low, first.high)


def has_rigid_contacts(plan: LimitPlan) -> bool:
    """Return True for rigid contacts, unless the key that is searched is one of their steps."""
    return not plan.document.build().time.has_springs and not plan.key.startswith("time.")


def step_of(scenario: Scenario) -> float:
    """Return the step (s) of a scenario, however it was chosen."""
    return float(build(scenario).scene.world.controls[0].step)
