"""Pictures of studies: what was found, brought into the form that the view draws."""

from pathlib import Path

import numpy as np

from blocksim.analysis.experiment import load_table
from blocksim.scenario import Scenario
from blocksim.study.convergence import Convergence, Study
from blocksim.study.series import read_series
from blocksim.view.levels import Panel, draw_levels
from blocksim.view.series import draw_series

FEWEST_LEVELS = 2  # to show a distance


def draw_convergence(result: Convergence, scenario: Scenario, path: Path) -> bool:
    """Draw a panel for each study with enough levels; tell whether there was one.

    Raises InvalidInputError for an unknown picture format and OutputError when the file cannot be written.
    """
    panels = [
        _panel(result, study)
        for study in result.studies
        if sum(level.is_finished for level in study.levels) >= FEWEST_LEVELS
    ]
    if panels:
        widths = {block: high - low for block, (low, high) in _measured_ranges(scenario, None).items()}
        draw_levels(panels, path, title=f"{result.name}: distance from the finest level", measured=widths)
    return bool(panels)


def draw_sweep(folder: Path, path: Path | None = None, experiment: Path | None = None) -> Path:
    """Draw where the blocks of a sweep end over its key; return the picture's path (default: NAME.png).

    Raises what `read_series` raises, InvalidInputError for an unknown picture format, OutputError.
    """
    found = read_series(folder)
    scenario = found.scenario
    path = path or Path(f"{scenario.name}.png")
    title = scenario.description or scenario.name
    ranges = _measured_ranges(scenario, experiment)
    draw_series(found.series, found.blocks, (found.key, found.unit), path, title=title, measured=ranges)
    return path


def _panel(result: Convergence, study: Study) -> Panel:
    levels = [level for level in study.levels if level.is_finished]
    x = np.array([level.x_mm for level in levels])
    return Panel(
        title=study.title,
        key=study.key,
        verdict=study.verdict.value,
        values=np.array([level.value for level in levels]),
        blocks=result.blocks,
        off_mm=np.abs(x - x[-1]),
        largest_off_mm=np.array([level.to_finest_mm for level in levels]),
        tolerance_mm=result.tolerance_mm,
        own=study.own.value,
        recommended=None if study.recommended is None else study.recommended.value,
    )


def _measured_ranges(scenario: Scenario, experiment: Path | None) -> dict[str, tuple[float, float]]:
    """Return smallest and largest measured x (mm) by block, from another table than the scenario's if one is given."""
    table = experiment or (None if scenario.experiment is None else scenario.experiment.table)
    if table is None:
        return {}
    statistics = load_table(table).statistics()
    centres = statistics[statistics["quantity"] == "x"]
    ends = (centres[column].astype(float) for column in ("minimum", "maximum"))
    return dict(zip(centres["block"], zip(*ends, strict=True), strict=True))
