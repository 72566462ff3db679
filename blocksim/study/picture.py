"""Pictures of studies: what was found, brought into the form that the view draws."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from blocksim.analysis.experiment import load_table
from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, load_stored
from blocksim.scenario.findings import did_you_mean_or_list
from blocksim.study.found import read_found
from blocksim.study.indices import read_indices
from blocksim.study.sweep_folder import PLAN
from blocksim.view.levels import Panel, draw_levels
from blocksim.view.paper import OWN, Paper
from blocksim.view.style import picture_suffix
from blocksim.view.sweeps.kind import Kind
from blocksim.view.sweeps.kinds import KINDS, kind_for
from blocksim.view.tornado import draw_tornado

if TYPE_CHECKING:
    from blocksim.study.convergence import Convergence, Study

FEWEST_LEVELS = 2  # to show a distance
TORNADO = "tornado"


def draw_convergence(result: "Convergence", scenario: Scenario, path: Path, paper: Paper = OWN) -> bool:
    """Draw a panel for each study with enough levels; return whether there was one.

    Raises InvalidInputError for an unknown picture format or too small a page, and OutputError when the file cannot be
    written.
    """
    panels = [
        _panel(result, study)
        for study in result.studies
        if sum(level.is_finished for level in study.levels) >= FEWEST_LEVELS
    ]
    if panels:
        widths = {block: high - low for block, (low, high) in _measured_ranges(scenario).items()}
        draw_levels(panels, path, title=f"{result.name}: distance from the finest level", measured=widths, paper=paper)
    return bool(panels)


def _anything_goes(_: Path) -> None:
    """Let a picture be written wherever it is to go."""


def draw_sweep(
    folder: Path,
    path: Path | None = None,
    experiment: Path | None = None,
    kind: str | None = None,
    paper: Paper = OWN,
    *,
    ready: Callable[[Path], None] = _anything_goes,
) -> Path:
    """Draw a sweep, by default as the kind that suits it; return the picture's path (default: NAME.png).

    `ready` is asked about the path before anything is drawn; it raises where no picture may go there.

    Raises what `read_found` raises, InvalidInputError for an unknown picture format or kind and for one that cannot
    show this sweep, OutputError.
    """
    chosen = None if kind is None else _kind_named(kind)
    found = read_found(folder, experiment)
    reason = "" if chosen is None else chosen.refusal(found)
    if reason:
        message = f"{folder}: {reason}"
        raise InvalidInputError(message)
    path = path or Path(f"{load_stored(folder / PLAN).name}.png")
    picture_suffix(path)
    ready(path)
    (chosen or kind_for(found)).draw(found, path, paper)
    return path


def draw_indices(
    table: Path,
    path: Path | None = None,
    kind: str | None = None,
    paper: Paper = OWN,
    *,
    ready: Callable[[Path], None] = _anything_goes,
) -> Path:
    """Draw the table of a sensitivity study; return the picture's path (default: that of the table, as PNG).

    `ready` is asked as in `draw_sweep`.
    Raises what `read_indices` raises, InvalidInputError for an unknown picture format or another kind, OutputError.
    """
    if kind not in {None, TORNADO}:
        message = f"{table}: a table of indices is drawn as {TORNADO!r}, not as {kind!r}"
        raise InvalidInputError(message)
    panels, labels = read_indices(table)
    path = path or Path(f"{table.stem}.png")
    ready(path)
    draw_tornado(panels, labels, path, title="Which inputs matter", paper=paper)
    return path


def _kind_named(name: str) -> Kind:
    if name == TORNADO:
        message = f"a {TORNADO} is drawn from a table of indices: blocksim sensitivity SCENARIO --out TABLE.csv"
        raise InvalidInputError(message)
    if name not in KINDS:
        message = f"--kind {name}: unknown kind, {did_you_mean_or_list(name, [*KINDS, TORNADO])}"
        raise InvalidInputError(message)
    return KINDS[name]


def _panel(result: "Convergence", study: "Study") -> Panel:
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


def _measured_ranges(scenario: Scenario) -> dict[str, tuple[float, float]]:
    """Return smallest and largest measured x (mm) by block."""
    table = None if scenario.experiment is None else scenario.experiment.table
    if table is None:
        return {}
    statistics = load_table(table).statistics()
    centres = statistics[statistics["quantity"] == "x"]
    ends = (centres[column].astype(float) for column in ("minimum", "maximum"))
    return dict(zip(centres["block"], zip(*ends, strict=True), strict=True))
