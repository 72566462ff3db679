"""Sweeps in a report: the table of sweep.csv, and the members whose frames were kept."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blocksim.scenario import Scenario
from blocksim.simulation.movement import OBSERVABLES
from blocksim.view.report.runs import Subject
from blocksim.view.report.shared import shared_path, shared_text

CASE, STATUS = "case", "status"  # what is varied stands between them
OF_BLOCKS = (".x_mm", ".y_mm", ".rotation_deg", ".left_mm", ".right_mm")
MOST_VALUES = 400_000  # of blocks in the page; a sweep of 10 000 cases shows 13 blocks


@dataclass(frozen=True)
class CaseTable:
    """The rows of sweep.csv as texts, by column."""

    folder: Path
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @property
    def varied(self) -> tuple[str, ...]:
        """Columns of the keys that vary, as `SweepResult.keys` has them."""
        return self.columns[self.columns.index(CASE) + 1 : self.columns.index(STATUS)]

    @property
    def results(self) -> tuple[str, ...]:
        """Columns of what is known of a whole case: status, movement and whatever else is not of a block."""
        known = {CASE, *self.varied}
        return tuple(name for name in self.columns if name not in known and not name.endswith(OF_BLOCKS))

    @property
    def blocks(self) -> tuple[str, ...]:
        """Names of the blocks."""
        return tuple(name.removesuffix(".x_mm") for name in self.columns if name.endswith(".x_mm"))

    def column(self, name: str) -> list[str]:
        """Return one column; empty texts where there is none."""
        if name not in self.columns:
            return [""] * len(self.rows)
        place = self.columns.index(name)
        return [row[place] for row in self.rows]


COLUMN_OF = {"x": "x_mm", "rotation": "rotation_deg"}
"""Measured quantities whose final values are in the page."""


def sweep_subject(
    key: str,
    table: CaseTable,
    scenario: Scenario | None,
    members: Mapping[str, str],
    problems: Sequence[str] = (),
    left_out: Sequence[str] = (),
    *,
    judged: Mapping[str, Any] | None = None,
    pictures: Sequence[Mapping[str, Any]] = (),
) -> Subject:
    """Return a sweep for a report; `members` are the keys of the subjects of its cases.

    `left_out` are cases with frames that are not in the page. `judged` is what `Judgement.to_dict` gives,
    `pictures` what `pictures_of` does.
    """
    name = table.folder.name if scenario is None else scenario.name
    shown = table.blocks[: max(1, MOST_VALUES // (2 * max(1, len(table.rows))))]
    rows = [] if judged is None else judged["metrics"]["inside"]["rows"]
    limits = {  # of inside, by the column of the table
        f"{row['block']}.{COLUMN_OF[row['quantity']]}": list(row["limits"])
        for row in rows
        if row["quantity"] in COLUMN_OF and row["limits"]
    }
    page = {
        "place": shared_path(str(table.folder)),
        "description": None if scenario is None else scenario.description,
        "summary": _summary(table, len(members)),
        "problems": [shared_text(text) for text in problems],
        "hidden_blocks": len(table.blocks) - len(shown),
        "has_members": bool(members),
        "judged": judged,
        "pictures": [(one["label"], one["source"]) for one in pictures],
    }
    data = {
        "kind": "sweep",
        "name": name,
        "place": shared_path(str(table.folder)),
        "columns": _columns(table, shown),
        "left_out": list(left_out),
        "measured": limits,
        "members": dict(members),
        "pictures": [one["data"] for one in pictures],
    }
    return Subject(key, "sweep", name, page, data)


def _columns(table: CaseTable, blocks: Sequence[str]) -> list[dict[str, Any]]:
    """Return names, roles and values; a column whose values are all numbers has numbers, an empty cell is null."""
    ends = [f"{block}{suffix}" for block in blocks for suffix in (".x_mm", ".rotation_deg")]
    roles = {"varied": table.varied, "case": (CASE,), "outcome": table.results, "block": ends}
    order = [CASE, *table.varied, *table.results, *ends]
    role = {name: kind for kind, names in roles.items() for name in names}
    labels = {one.name: {"label": one.label} for one in OBSERVABLES.values() if one.title}
    return [
        {
            "name": name,
            **labels.get(name, {}),
            "role": role[name],
            "values": _values(table.column(name), is_text=name == CASE),
        }
        for name in order
        if name in table.columns
    ]


def _values(texts: Sequence[str], *, is_text: bool) -> list[Any]:
    if is_text:
        return list(texts)
    numbers = [_number(text) for text in texts]
    if all(number is not None or not text for number, text in zip(numbers, texts, strict=True)):
        return numbers
    return [text or None for text in texts]


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _summary(table: CaseTable, members: int) -> list[tuple[str, str]]:
    cases = len(table.rows)
    finished = table.column("status").count("finished")
    judged = [value for value in table.column("inside") if value]
    inside = [] if not judged else [("inside all measured ranges", f"{judged.count('True')} of {len(judged)}")]
    return [
        ("cases", str(cases)),
        ("finished", f"{finished} of {cases}"),
        *inside,
        ("varied", ", ".join(table.varied) or "nothing"),
        ("runs in this page", str(members)),
    ]
