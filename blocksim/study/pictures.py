"""Pictures of sweeps and studies, and which picture a place has: of a run, a sweep, a study or a table."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from blocksim.analysis.experiment import load_table
from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.options import takes
from blocksim.scenario import Scenario, load_stored
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.study.index_pictures import TORNADO, anything_goes, draw_indices
from blocksim.study.run_pictures import PlotOptions, draw_motion_of, draw_probes_of, draw_run
from blocksim.study.stored_run import Place, folder_of
from blocksim.study.study import draw_study, study_in
from blocksim.study.sweep_data import read_sweep_data, unit_of
from blocksim.study.sweep_folder import PLAN
from blocksim.study.sweep_table import is_sweep
from blocksim.view.kinds import MOTION, PROBE, STRIP, SWEEP_KINDS, kind_for
from blocksim.view.layout import OWN, Paper
from blocksim.view.levels import Panel, draw_levels
from blocksim.view.style import picture_suffix

if TYPE_CHECKING:
    from blocksim.study.convergence import Convergence, RefinementStudy

FEWEST_LEVELS = 2  # to show a distance


def draw_convergence(result: "Convergence", scenario: Scenario, path: Path, paper: Paper = OWN) -> bool:
    """Draw a panel for each study with enough levels; return whether there was one.

    Raises InvalidInputError for an unknown picture format or too small a page, and OutputError when the file cannot be
    written.
    """
    panels = [
        _panel(result, study, unit_of(scenario, study.key))
        for study in result.studies
        if sum(level.is_finished for level in study.levels) >= FEWEST_LEVELS
    ]
    if panels:
        table = None if scenario.experiment is None else load_table(scenario.experiment.table)
        rows = [] if table is None else [row for row in table.summaries() if row.quantity == "x"]
        widths = {row.block: row.maximum - row.minimum for row in rows}  # of the measured ranges
        draw_levels(panels, path, title=f"{result.name}: distance from the finest level", measured=widths, paper=paper)
    return bool(panels)


def draw_sweep(
    folder: Path,
    path: Path | None = None,
    experiment: Path | None = None,
    kind: str | None = None,
    paper: Paper = OWN,
    *,
    ready: Callable[[Path], None] = anything_goes,
) -> Path:
    """Draw a sweep, by default as the kind that suits it; return the picture's path (default: NAME.png).

    `ready` is asked about the path before anything is drawn; it raises where no picture may go there.

    Raises what `read_sweep_data` raises, InvalidInputError for an unknown picture format or kind and for one that
    cannot show this sweep, OutputError.
    """
    if kind == TORNADO:
        message = f"a {TORNADO} is drawn from a table of indices: blocksim sensitivity SCENARIO --out TABLE.csv"
        raise InvalidInputError(message)
    if kind is not None and kind not in SWEEP_KINDS:
        message = f"--kind {kind}: unknown kind, {did_you_mean_or_list(kind, [*SWEEP_KINDS, TORNADO])}"
        raise InvalidInputError(message)
    found = read_sweep_data(folder, experiment)
    chosen = kind_for(found) if kind is None else SWEEP_KINDS[kind]
    if kind is not None and (reason := chosen.refusal(found)):
        raise InvalidInputError(f"{folder}: {reason}")
    path = path or Path(f"{load_stored(folder / PLAN).name}.png")
    picture_suffix(path)
    ready(path)
    chosen.draw(found, path, paper)
    return path


def _panel(result: "Convergence", study: "RefinementStudy", unit: str) -> Panel:
    levels = [level for level in study.levels if level.is_finished]
    x = np.array([level.x_mm for level in levels])
    return Panel(
        title=study.title,
        key=f"{study.key} ({unit})" if unit else study.key,
        verdict=study.verdict.value,
        values=np.array([level.value for level in levels]),
        blocks=result.blocks,
        off_mm=np.abs(x - x[-1]),
        largest_off_mm=np.array([level.to_finest_mm for level in levels]),
        tolerance_mm=result.tolerance_mm,
        own=study.own.value,
        recommended=None if study.recommended is None else study.recommended.value,
    )


@takes(PlotOptions)
def plot(place: Place, options: PlotOptions) -> Path:
    """Draw a run, a sweep, a study or a table of sensitivities.

    `place` is a result that is kept in a folder, a sweep, or what the command takes. Returns the path of the picture
    (default: NAME.png in the current folder). Raises InvalidInputError for an unknown kind or format, too small a page
    and a result that was not kept, InputMissingError, OutputExistsError for a file of others unless `overwrite`,
    OutputError.
    """
    return draw(folder_of(place), options)[0]


def draw(place: Path, options: PlotOptions) -> tuple[Path, str]:
    """Draw what lies at a place, see `plot`; return the picture's path and a remark on an unfinished run."""
    if not place.exists():
        message = f"{place}: no such run folder, sweep folder, table or scenario file"
        raise InputMissingError(message)
    out = None if options.out is None else Path(options.out)
    kind, paper, ready = options.kind, options.paper, options.ready
    study = study_in(place)
    if study is not None:
        options.refuse(None, f"{place} is {study.answer.files.what}")
        return draw_study(place, study, out, kind, paper, ready, options.table), ""
    if is_sweep(place):
        options.refuse(None, f"{place} is a sweep")
        return draw_sweep(place, out, options.table, kind, paper, ready=ready), ""
    if place.suffix.lower() == ".csv":
        options.refuse(None, f"{place} is a table")
        return draw_indices(place, out, kind, paper, ready=ready), ""
    if kind in {MOTION, PROBE}:
        options.refuse(kind, f"this picture is of kind {kind}")
        return (draw_motion_of(place, options), "") if kind == MOTION else draw_probes_of(place, options)
    return draw_run(place, options, kind or STRIP)
