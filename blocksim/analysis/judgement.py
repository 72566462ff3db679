"""Judgement of an ensemble, the members of a sweep, against the repeats of an experiment by all metrics."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING

from blocksim.analysis.compare import html_of, plain
from blocksim.analysis.evidence import Evidence, Failure, Findings, Members
from blocksim.analysis.experiment import ExperimentTable
from blocksim.analysis.metrics import METRICS
from blocksim.errors import InvalidInputError

if TYPE_CHECKING:
    import pandas as pd

U_NUM = 0.5  # mm: numerical error that step and stiffness may cause in an affordable ensemble
THRESHOLD = 0.5


@dataclass(frozen=True)
class Settings:
    """Settings: the share of members that must be inside, and u_num (mm)."""

    threshold: float = THRESHOLD
    u_num: float = U_NUM

    def __post_init__(self) -> None:
        """Raise InvalidInputError for an invalid share or uncertainty."""
        if not 0.0 <= self.threshold <= 1.0:
            message = f"threshold {self.threshold} is not a share from 0 to 1"
            raise InvalidInputError(message)
        if not 0.0 <= self.u_num < inf:
            message = f"u_num {self.u_num} is not an uncertainty in mm: a number from 0 up"
            raise InvalidInputError(message)


@dataclass(frozen=True, eq=False, repr=False)
class Judgement:
    """Results of all metrics by name; `sweep` and `source` are what was compared."""

    sweep: str
    source: str
    members: int
    inside_all: int
    failures: tuple[Failure, ...]
    settings: Settings
    findings: Mapping[str, Findings]
    messages: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return a line: sweep, table, share inside and the verdict."""
        verdict = "inside" if self.inside else "outside"
        share = f"{self.inside_all} of {self.members} samples inside all ranges"
        return f"<Judgement of {self.sweep} against {self.source}: {share}, {verdict}>"

    @property
    def share_inside(self) -> float:
        """Share of all members, failed ones included, that are within all measured ranges."""
        return self.inside_all / self.members

    @property
    def inside(self) -> bool:
        """Whether that share reaches the threshold."""
        return self.share_inside >= self.settings.threshold

    def to_frame(self, metric: str = "inside") -> "pd.DataFrame":
        """Return the rows of one metric; its columns are explained in METRICS."""
        import pandas as pd

        names = [column.name for column in METRICS[metric].columns]
        return pd.DataFrame(self.findings[metric].rows, columns=names)

    def _repr_html_(self) -> str:
        """Return the same line above the samples inside the measured limits, for notebooks."""
        return html_of(self, self.to_frame())

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON, with the meaning of each; a missing number is None."""
        return {
            "sweep": self.sweep,
            "experiment": self.source,
            "members": self.members,
            "finished": self.members - len(self.failures),
            "failed": [failure._asdict() for failure in self.failures],
            "inside_all": self.inside_all,
            "share_inside": self.share_inside,
            "threshold": self.settings.threshold,
            "inside": self.inside,
            "messages": list(self.messages),
            "metrics": {
                name: {
                    "meaning": METRICS[name].meaning,
                    "columns": {column.name: column.meaning for column in METRICS[name].columns},
                    "rows": [{key: plain(value) for key, value in row.items()} for row in found.rows],
                    "messages": list(found.messages),
                }
                for name, found in self.findings.items()
            },
        }


def judge(
    members: Members, table: ExperimentTable, settings: Settings | None = None, messages: tuple[str, ...] = ()
) -> Judgement:
    """Judge the members of a sweep by all metrics.

    Raises InvalidInputError where members lack a measured block or quantity, UnavailableError without scipy.
    """
    settings = settings or Settings()
    table.refuse_unknown(members.blocks, "the sweep")
    evidence, finished = Evidence(members, table, settings.u_num), int(members.finished.sum())
    incomplete = (  # measured quantities of which finished samples have no value
        f"{finished - pair.known.size} finished samples have no {pair.name}: they count as outside"
        for pair in evidence.pairs
        if pair.known.size < finished
    )
    return Judgement(
        sweep=members.source,
        source=table.source,
        members=members.count,
        inside_all=int(evidence.inside.sum()),
        failures=members.failures,
        settings=settings,
        findings={name: metric.find(evidence) for name, metric in METRICS.items()},
        messages=(*messages, *table.messages, *table.unmeasured(members.blocks), *incomplete),
    )
