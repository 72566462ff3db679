"""Made-up sweeps and experiments, as small as they can be."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from blocksim.analysis.evidence import Evidence, Findings, Members, evidence_of as joined
from blocksim.analysis.experiment import QUANTITIES, ExperimentTable, Measurement
from blocksim.analysis.metrics import METRICS

Key = tuple[str, str]  # block and quantity


def members_of(values: Mapping[Key, Sequence[float]], statuses: Sequence[str] = ()) -> Members:
    """Return members that end at these values (mm, deg), all finished unless `statuses` says otherwise."""
    count = len(next(iter(values.values())))
    columns: dict[str, object] = {
        "case": [f"c{number}" for number in range(1, count + 1)],
        "status": list(statuses) or ["finished"] * count,
        "reason": "as it is",
    }
    columns |= {f"{block}.{QUANTITIES[name].final_column}": list(data) for (block, name), data in values.items()}
    return Members(pd.DataFrame(columns), "sweep.csv")


def table_of(values: Mapping[Key, Sequence[float]]) -> ExperimentTable:
    """Return repeats 1, 2, 3 ...; NaN leaves one out."""
    rows = [
        Measurement(block, name, QUANTITIES[name].unit, number, value)
        for (block, name), repeats in values.items()
        for number, value in enumerate(repeats, 1)
        if np.isfinite(value)
    ]
    return ExperimentTable(tuple(rows), "repeats.csv")


def evidence_of(
    members: Mapping[Key, Sequence[float]],
    repeats: Mapping[Key, Sequence[float]],
    statuses: Sequence[str] = (),
    u_num: float = 0.0,
) -> Evidence:
    """Return what metrics are computed from."""
    return joined(members_of(members, statuses), table_of(repeats), u_num)


def found_by(metric: str, *arguments: object, **options: object) -> Findings:
    """Return the findings of one metric for made-up members and repeats; every row has all columns."""
    findings = METRICS[metric].find(evidence_of(*arguments, **options))  # type: ignore[arg-type]
    names = {column.name for column in METRICS[metric].columns}
    assert all(set(row) == names for row in findings.rows)
    return findings
