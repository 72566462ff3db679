"""Tables 1 to 3 of the paper as Markdown: printed values with those of the scenarios.

Measurements are in scenarios/experiments; the results of the paper's own simulation are here.
"""

from collections.abc import Mapping, Sequence
from math import isfinite

from blocksim.analysis.compare import ComparisonRow, Verdict, compare_final
from blocksim.analysis.experiment import ExperimentTable
from blocksim.scenario import Scenario
from blocksim.simulation.result import Result
from blocksim.verification.paper.laws import Bounce
from blocksim.verification.reference import markdown

PAPER_X = {"1": "16", "2": "76.05", "3": "about 130"}  # mm, section 3.3 of the paper
SIGNS = {Verdict.INSIDE: "✓", Verdict.OUTSIDE: "✗", Verdict.NO_DATA: ""}
FACTORS = {"mm": 1e3, "kN/m³": 1e-3, "GPa": 1e-9, "": 1.0}
PRINTED = {  # property of the table, its name in the paper, unit
    "width": ("width", "mm"),
    "height": ("height", "mm"),
    "length": ("length", "mm"),
    "overlap": ("overlap Δx", "mm"),
    "unit_weight": ("density ρ (a unit weight)", "kN/m³"),
    "young_modulus": ("Young's modulus E", "GPa"),
    "poisson_ratio": ("Poisson's ratio ν", ""),
    "friction_block_block": ("friction between blocks μ", ""),
    "friction_block_ground": ("friction with the ground k", ""),
}


def properties_table(printed: Mapping[str, float], scenario: Scenario) -> str:
    """Return Table 1, and the sizes, with those of a scenario."""
    used = _used(scenario)
    rows = []
    for name, (label, unit) in PRINTED.items():
        factor = FACTORS[unit]
        rows.append((label, f"{printed[name] * factor:.4g}", f"{used[name] * factor:.4g}", unit))
    return _table(("property", "printed", f"`{scenario.name}`", "unit"), rows)


def edges_table(edges: ExperimentTable, runs: Sequence[Result]) -> str:
    """Return Table 2: the outer edges of the blocks in all repeats, and in runs."""
    rows = [
        _measured_row(edges, block, quantity, f"{quantity}, block {block}", [run.columns for run in runs])
        for quantity in ("left", "right")
        for block in edges.blocks
    ]
    return _table((*_repeats_heads(edges), *(f"`{run.name}`" for run in runs)), rows)


def centres_table(centres: ExperimentTable, runs: Sequence[Result]) -> str:
    """Return Table 3: the centres in all repeats, by the paper's own simulation, and in runs with verdicts."""
    judged = [_judged(run, centres) for run in runs]
    rows = []
    for block in centres.blocks:
        row = _measured_row(centres, block, "x", f"block {block}", [])
        cells = [_verdict_cell(one.get((block, "x"))) for one in judged]
        rows.append((*row, PAPER_X.get(block, ""), *cells))
    heads = (*_repeats_heads(centres), "the paper's simulation", *(f"`{run.name}`" for run in runs))
    return _table(heads, rows)


def rotations_table(centres: ExperimentTable, runs: Sequence[Result]) -> str:
    """Return the rotations of section 3.2, and those of runs with verdicts."""
    judged = [_judged(run, centres) for run in runs]
    measured = {row.block: row.mean for row in centres.summaries() if row.quantity == "rotation"}
    rows = [
        (f"block {block}", f"{mean:.0f}", *(_verdict_cell(one.get((block, "rotation"))) for one in judged))
        for block, mean in measured.items()
    ]
    return _table(("block", "measured, all repeats", *(f"`{run.name}`" for run in runs)), rows)


def bounces_table(bounces: Sequence[Bounce]) -> str:
    """Return apexes and flight times with those of Eq. 12."""
    rows = [
        (str(one.number), *(f"{value:.3f}" for value in (one.eq12_apex, one.apex, one.eq12_flight, one.flight)))
        for one in bounces
    ]
    heads = ("impact p", "h_p by Eq. 12, mm", "simulated, mm", "t_p by Eq. 12, ms", "simulated, ms")
    return _table(heads, rows)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; the minus sign of numbers is a proper one."""
    return markdown(heads, [[f"−{cell[1:]}" if cell.startswith("-") else cell for cell in row] for row in rows])


def _repeats_heads(table: ExperimentTable) -> tuple[str, ...]:
    return ("mm", *(str(number) for number in table.replicates), "mean")


def _measured_row(
    table: ExperimentTable, block: str, quantity: str, label: str, columns: Sequence[Mapping[str, Sequence[object]]]
) -> tuple[str, ...]:
    """Return the repeats of one quantity, their mean, and the value in final tables."""
    values = [one.value for one in table.measurements if (one.block, one.quantity) == (block, quantity)]
    mean = sum(values) / len(values)
    runs = [f"{final[f'{quantity}_mm'][list(final['block']).index(block)]:.2f}" for final in columns]
    return (label, *(f"{value:.2f}" for value in values), f"{mean:.2f}", *(_plain(text) for text in runs))


def _judged(run: Result, centres: ExperimentTable) -> dict[tuple[str, str], ComparisonRow]:
    return {(row.block, row.quantity): row for row in compare_final(run.columns, centres).rows}


def _verdict_cell(row: ComparisonRow | None) -> str:
    if row is None or not isfinite(row.simulated):
        return "–"
    return f"{_plain(f'{row.simulated:.2f}')} {SIGNS[row.verdict]}"


def _plain(text: str) -> str:
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def _used(scenario: Scenario) -> dict[str, float]:
    """Return a scenario's sizes, material and static frictions (SI) by the names of the table of properties."""
    block, material = next(iter(scenario.blocks.values())), next(iter(scenario.materials.values()))
    overlaps = [overlap for one in scenario.structures if (overlap := getattr(one, "overlap", None)) is not None]
    return {name: float(getattr(block, name)) for name in ("width", "height", "length")} | {
        "overlap": overlaps[0] if overlaps else float("nan"),
        "unit_weight": material.density * scenario.gravity,
        "young_modulus": material.young_modulus,
        "poisson_ratio": material.poisson_ratio,
        "friction_block_block": scenario.friction.block_block.static,
        "friction_block_ground": scenario.friction.block_ground.static,
    }
