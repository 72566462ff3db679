"""A limit at each value of another key: least thickness over friction, critical tilt over the number of courses.

Each value has a search of its own in a folder of its own, so what was stopped goes on where it was.
"""

import hashlib
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document, Source, document_of
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.provenance import HASH_DIGITS
from blocksim.study import criterion
from blocksim.study.executors import Execution
from blocksim.study.limit import OnRun, find_limit
from blocksim.study.limit_plan import SCANNED, TOLERANCE, LimitPlan, read_limit
from blocksim.study.limit_result import LimitResult
from blocksim.study.limit_stiff import refuse_without_springs
from blocksim.study.plan import Values, Variations
from blocksim.study.rows import Head
from blocksim.study.sweep_folder import LIMIT_CURVE, OVER, prepare, write_answer
from blocksim.study.typed_levels import typed_levels

if TYPE_CHECKING:
    import pandas as pd

OPTION = "--over"
TABLE = "limits.csv"
COLUMNS = ("low", "high", "below", "above")
MOST_VALUES = 1000
OnLimit = Callable[[float, LimitResult], None]


@dataclass(frozen=True)
class CurvePlan:
    """The searches of a curve, by the number of the other key."""

    head: Head  # key and unit of that
    searches: Mapping[float, LimitPlan]

    @property
    def one(self) -> LimitPlan:
        """Any of the searches: key, unit, range and criterion are those of all."""
        return next(iter(self.searches.values()))

    @property
    def name(self) -> str:
        """A hash of everything that decides the answer."""
        text = json.dumps([self.head.key, *(plan.name for plan in self.searches.values())])
        return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]

    def shown(self, number: float) -> str:
        """Return a value of the other key for people."""
        return shown(number, self.head.unit)


def shown(number: float, unit: str) -> str:
    """Return a value of the other key for people."""
    return f"{number:.6g} {unit}".rstrip()


@dataclass(frozen=True)
class CurveResult:
    """The searches by the value of the other key, from the smallest up."""

    plan: CurvePlan = field(repr=False)
    folder: Path
    searches: Mapping[float, LimitResult] = field(repr=False)

    @property
    def table(self) -> "pd.DataFrame":
        """The brackets as limits.csv has them: one row each, one without numbers where nothing changes."""
        import pandas as pd

        return pd.DataFrame(list(curve_rows(self.searches)), columns=_heads(self.plan))

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        found = self.plan.one
        return {
            "key": found.key,
            "unit": found.unit,
            "over": self.plan.head.key,
            "over_unit": self.plan.head.unit,
            "stands": found.criterion.text,
            "points": [{OVER: value, **search.to_dict()} for value, search in self.searches.items()],
        }

    def __repr__(self) -> str:
        """Return a line: keys, number of values, folder."""
        return (
            f"<CurveResult {self.plan.one.key} over {self.plan.head.key}: {len(self.searches)} values, {self.folder}>"
        )


def limit_curve(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    vary: Mapping[str, Values],
    over: Mapping[str, Values],
    *,
    stands: str = criterion.DEFAULT,
    tolerance: float = TOLERANCE,
    scan: int = SCANNED,
    executor: str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    out: Path | str | None = None,
    overwrite: bool = False,
    stiffer: bool | None = None,
) -> CurveResult:
    """Find the limits of a key at each value of another one: `limit` with `over`, {"friction.block_block": [0.3, 0.5]}.

    Searches are kept in `out` (default: results/NAME/limits-HASH). Raises as `limit`.
    """
    plan = read_curve(document_of(scenario), vary, over, stands=stands, tolerance=tolerance, scan=scan)
    return find_curve(
        plan,
        Execution(executor=executor, jobs=jobs, scheduler=scheduler),
        out=out,
        overwrite=overwrite,
        stiffer=stiffer,
    )


def read_curve(
    document: Document,
    vary: Mapping[str, Values] | Variations,
    over: Mapping[str, Values] | Variations,
    *,
    stands: str,
    tolerance: float,
    scan: int = SCANNED,
) -> CurvePlan:
    """Return the plan of a curve. Raises as `read_limit`, for every value of the other key."""
    given = over if isinstance(over, Variations) else Variations.of(over)
    if len(given.tables) != 1:
        message = f"limits are searched over one key, not {len(given.tables)}: give {OPTION} KEY=a,b,c once"
        raise InvalidInputError(message)
    bare = document.without_sweep()
    head, levels = typed_levels(bare, given, OPTION)
    if len(levels) > MOST_VALUES:
        message = f"{len(levels)} values are too many; at most {MOST_VALUES} are searched"
        raise InvalidInputError(message)
    return CurvePlan(
        head,
        {
            number: read_limit(bare.with_values({head.key: value}), vary, stands=stands, tolerance=tolerance, scan=scan)
            for number, value in levels.items()
        },
    )


def find_curve(
    plan: CurvePlan,
    execution: Execution,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    stiffer: bool | None = None,
    on_run: OnRun = silent,
    on_limit: OnLimit = silent,
) -> CurveResult:
    """Search as planned, one value after the other; see `limit_curve`."""
    execution.ready()
    if stiffer:
        refuse_without_springs(*plan.searches.values())
    base = plan.one.scenario_at(plan.one.span.low)
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"limits-{plan.name}"
    prepare(folder, base, plan.name, overwrite=overwrite, kind=LIMIT_CURVE)
    found: dict[float, LimitResult] = {}
    for number, search in plan.searches.items():
        place = folder / folder_named(number, plan.head.unit)
        found[number] = find_limit(
            search, execution, out=place, overwrite=overwrite, keep_runs=False, stiffer=stiffer, on_run=on_run
        )
        on_limit(number, found[number])
    result = CurveResult(plan, folder, found)
    _write(result)
    return result


def folder_named(number: float, unit: str) -> str:
    """Return the name of the folder of a value of the other key, one that needs no quotes in a shell."""
    return re.sub(r"[^A-Za-z0-9.+-]+", "-", shown(number, unit))


def _heads(plan: CurvePlan) -> list[str]:
    unit, other = plan.one.unit, plan.head.unit
    names = [f"{name} [{unit}]" if unit and name in COLUMNS[:2] else name for name in COLUMNS]
    return [f"{OVER} [{other}]" if other else OVER, *names]


def curve_rows(searches: Mapping[float, LimitResult]) -> Iterator[list[Any]]:
    """Yield the rows of limits.csv."""
    for value, search in searches.items():
        for one in search.changes:
            yield [value, one.low, one.high, one.below.value, one.above.value]
        if not search.changes:
            (verdict,) = set(search.verdicts.values())
            yield [value, None, None, verdict.value, verdict.value]


def _write(result: CurveResult) -> None:
    """Write limits.csv, and the answer into limits.json."""
    rows = [_heads(result.plan), *curve_rows(result.searches)]
    write_answer(result.folder / TABLE, LIMIT_CURVE, rows, result.to_dict())
