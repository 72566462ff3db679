"""Pictures of runs, sweeps and studies: what was found, brought into the form that the view draws."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.analysis.experiment import load_table
from blocksim.errors import InputMissingError, InvalidInputError, Problem
from blocksim.scenario import Scenario, load_scenario, load_stored
from blocksim.scenario.csv_table import Cell, raise_problems, read_open_table
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.simulation import folder as files
from blocksim.simulation.stores.hdf5_probes import read_probes
from blocksim.study.stored_run import find_run, stored_run
from blocksim.study.study_pictures import draw_study, study_in
from blocksim.study.sweep_data import read_sweep_data, unit_of
from blocksim.study.sweep_folder import PLAN
from blocksim.study.sweep_table import is_sweep
from blocksim.view.history_panels import Choice
from blocksim.view.kinds import FINAL, HISTORY, MOTION, PROBE, PROFILE, STRIP, SWEEP_KINDS, Kind, kind_for, run_kind
from blocksim.view.layout import OWN, Paper
from blocksim.view.levels import Panel, draw_levels
from blocksim.view.motion import draw_support_motion
from blocksim.view.paint import paint_named
from blocksim.view.probes import draw_probes
from blocksim.view.run_data import support_of
from blocksim.view.style import picture_suffix
from blocksim.view.tornado import Bars, draw_tornado

if TYPE_CHECKING:
    from blocksim.study.convergence import Convergence, Study

FEWEST_LEVELS = 2  # to show a distance
TORNADO = "tornado"
MEANINGS = {
    "--at": "selects frames of a run's strip, final picture or profile",
    "--frames": "sets the number of panels of a run's strip",
    "--panels": "selects the panels of a run's history",
    "--block": "selects the blocks of a run's history",
    "--probe": "selects the probes of a run",
    "--relative": "plots a run's history relative to the ground",
    "--forces": "shows contacts of a run",
    "--colour": "colours the blocks of a run",
}
LARGEST_FILE = 10_000_000  # bytes
HEAD = ("output", "unit", "key")
UNITLESS = ("share", "")


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

    Raises what `read_sweep_data` raises, InvalidInputError for an unknown picture format or kind and for one that
    cannot show this sweep, OutputError.
    """
    chosen = None if kind is None else _kind_named(kind)
    found = read_sweep_data(folder, experiment)
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
    if name not in SWEEP_KINDS:
        message = f"--kind {name}: unknown kind, {did_you_mean_or_list(name, [*SWEEP_KINDS, TORNADO])}"
        raise InvalidInputError(message)
    return SWEEP_KINDS[name]


def _panel(result: "Convergence", study: "Study", unit: str) -> Panel:
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


def _measured_ranges(scenario: Scenario) -> dict[str, tuple[float, float]]:
    """Return smallest and largest measured x (mm) by block."""
    table = None if scenario.experiment is None else scenario.experiment.table
    if table is None:
        return {}
    statistics = load_table(table).statistics()
    centres = statistics[statistics["quantity"] == "x"]
    ends = (centres[column].astype(float) for column in ("minimum", "maximum"))
    return dict(zip(centres["block"], zip(*ends, strict=True), strict=True))


@dataclass(frozen=True)
class RunLook:
    """What was asked of the picture of a run."""

    times: tuple[float, ...] | None = None  # s, of the panels of a strip or of a final picture
    frames: int | None = None  # panels of a strip
    panels: tuple[str, ...] | None = None  # of a history
    blocks: tuple[str, ...] | None = None  # of a history, by name
    relative: bool = False  # to the moving support
    colour: str = "block"
    forces: bool = False
    probes: tuple[str, ...] | None = None  # by name

    def of_runs(self) -> list[str]:
        """Return the options that were given and mean nothing for a sweep."""
        forces, colour = {"--forces": self.forces}, {"--colour": self.colour != "block"}
        given = {**self._of_strips(), **self._of_histories(), **self._of_probes(), **forces, **colour}
        return [option for option, is_given in given.items() if is_given]

    def beside(self, kind: str) -> list[str]:
        """Return the options that were given and mean nothing for a kind of picture."""
        if kind == PROBE:
            return [option for option in self.of_runs() if option != "--probe"]
        of_one_panel = {**self._of_histories(), "--frames": self.frames is not None}
        meant = {STRIP: self._of_histories(), FINAL: of_one_panel, PROFILE: of_one_panel}
        given = {**meant.get(kind, self._of_strips()), **self._of_probes()}
        return [option for option, is_given in given.items() if is_given]

    def arguments(self, kind: str) -> dict[str, Any]:
        """Return what a kind of picture is drawn with."""
        if kind == HISTORY:
            return {"choice": Choice(self.panels or (), self.blocks or (), self.relative)}
        return {"times": self.times, "count": self.frames} if kind == STRIP else {"times": self.times}

    def _of_probes(self) -> dict[str, bool]:
        return {"--probe": self.probes is not None}

    def _of_strips(self) -> dict[str, bool]:
        return {"--at": self.times is not None, "--frames": self.frames is not None}

    def _of_histories(self) -> dict[str, bool]:
        return {"--panels": self.panels is not None, "--block": self.blocks is not None, "--relative": self.relative}


def draw_run(  # noqa: PLR0913 - what a picture is made of
    run: Path,
    out: Path | None,
    asked: RunLook,
    experiment: Path | None,
    kind: str,
    paper: Paper,
    *,
    ready: Callable[[Path], None],
) -> tuple[Path, str]:
    """Draw a run; return the picture's path (default: NAME.png or NAME_KIND.png) and a remark on an unfinished run.

    `ready` is called with the path before anything is drawn and may refuse it. Raises InvalidInputError for an unknown
    kind or format and options that mean nothing for it, what `stored_run` raises, OutputError.
    """
    draw = run_kind(kind)
    refuse(asked.beside(kind), f"this picture is of kind {kind}")
    stored = stored_run(run)
    scenario = stored.scenario
    table = experiment or (scenario.experiment.table if scenario.experiment is not None else None)
    measured = None if table is None else load_table(table)
    picture = out or Path(f"{scenario.name}.png" if kind == STRIP else f"{scenario.name}_{kind}.png")
    ready(picture)
    support = support_of(scenario, stored.events)
    look = {"title": scenario.name, "measured": measured, "support": support, "forces": asked.forces}
    paint = paint_named(asked.colour, stored.frames, scenario)
    draw(stored.frames, picture, **look, **asked.arguments(kind), paint=paint, paper=paper)
    return picture, stored.remark


def draw(  # noqa: PLR0913 - what a picture is made of
    place: Path,
    out: Path | None,
    asked: RunLook,
    experiment: Path | None,
    kind: str | None,
    paper: Paper,
    *,
    ready: Callable[[Path], None],
) -> tuple[Path, str]:
    """Draw what lies at a place: a run, a sweep, a study, or a table of sensitivities; return as `draw_run`.

    Raises as that does, and InputMissingError where nothing is there.
    """
    if not place.exists():
        message = f"{place}: no such run folder, sweep folder, table or scenario file"
        raise InputMissingError(message)
    study = study_in(place)
    if study is not None:
        refuse(asked.of_runs(), f"{place} is {study.what}")
        return draw_study(place, study, out, kind, paper, ready), ""
    if is_sweep(place):
        refuse(asked.of_runs(), f"{place} is a sweep")
        return draw_sweep(place, out, experiment, kind, paper, ready=ready), ""
    if place.suffix.lower() == ".csv":
        refuse(asked.of_runs(), f"{place} is a table")
        return draw_indices(place, out, kind, paper, ready=ready), ""
    if kind == MOTION:
        refuse(asked.of_runs(), f"this picture is of kind {kind}")
        return draw_motion_of(place, out, paper, ready=ready), ""
    if kind == PROBE:
        refuse(asked.beside(kind), f"this picture is of kind {kind}")
        return draw_probes_of(place, out, asked.probes or (), paper, ready=ready)
    return draw_run(place, out, asked, experiment, kind or STRIP, paper, ready=ready)


def draw_probes_of(
    place: Path, out: Path | None, names: Sequence[str], paper: Paper, *, ready: Callable[[Path], None]
) -> tuple[Path, str]:
    """Draw the probes of a run, all or those of these names; return as `draw_run`.

    Raises what `stored_run`, reading the probes and `draw_probes` raise.
    """
    stored = stored_run(place)
    picture = out or Path(f"{stored.scenario.name}_{PROBE}.png")
    ready(picture)
    probes = read_probes(stored.folder / files.FRAMES, stored.scenario)
    draw_probes(probes, picture, f"{stored.scenario.name}: probes", names, paper)
    return picture, stored.remark


def draw_motion_of(place: Path, out: Path | None, paper: Paper, *, ready: Callable[[Path], None]) -> Path:
    """Draw how the supports of a run or of a scenario file move, which need not have been run; return the picture.

    Raises what loading the scenario and `draw_support_motion` raise.
    """
    if place.is_file():
        scenario = load_scenario(place)
    else:
        scenario = load_stored(find_run(place, needed=(files.SCENARIO,)) / files.SCENARIO)
    picture = out or Path(f"{scenario.name}_{MOTION}.png")
    ready(picture)
    draw_support_motion(support_of(scenario), scenario.time.end, picture, f"{scenario.name}: motion", paper)
    return picture


def refuse(given: Sequence[str], what: str) -> None:
    """Raise InvalidInputError for options that mean nothing for what is drawn."""
    if given:
        message = f"{given[0]} {MEANINGS[given[0]]}, but {what}"
        raise InvalidInputError(message)


@dataclass(frozen=True)
class Shown:
    """The columns of a method that a picture shows, what the bars mean, and what their dark parts do."""

    value: str
    half_width: str
    part: str
    labels: tuple[str, str]
    has_unit: bool


METHODS = (
    Shown("ST", "± ST", "S1", ("total share of the variance, 95 % interval", "share of the key alone"), has_unit=False),
    Shown("mu*", "±", "", ("mean change over a key's range, 95 % interval", ""), has_unit=True),
)


def read_indices(path: Path) -> tuple[list[Bars], tuple[str, str]]:
    """Return the bars of every result and what they mean.

    Raises InputMissingError or InvalidInputError, with every mistake located.
    """
    heads, table = read_open_table(path, LARGEST_FILE)
    names = [head.text for head in heads]
    shown = next((one for one in METHODS if {*HEAD, one.value, one.half_width} <= set(names)), None)
    if shown is None:
        message = "not the table of `blocksim sensitivity --out`: no columns output, unit, key and ST or mu*"
        raise_problems([table.header.problem(message)])
    rows = [{name: _read(cell, table.problems) for name, cell in row.items()} for row in table.rows]
    if table.problems:
        raise_problems(table.problems)
    if not rows:
        message = f"{path}: no result varies; nothing to draw"
        raise InvalidInputError(message)
    outputs = dict.fromkeys(str(row["output"]) for row in rows)
    return [_bars([row for row in rows if row["output"] == output], shown) for output in outputs], shown.labels


def _read(cell: Cell, problems: list[Problem]) -> str | float:
    """Return the text of a name or the number of an index; 0 after noting a problem."""
    if cell.column in HEAD:
        return cell.text
    if cell.text in {"", "nan"}:
        return float("nan")
    try:
        return cell.number()
    except ValueError as error:
        problems.append(cell.problem(str(error)))
        return 0.0


def _bars(rows: list[dict[str, str | float]], shown: Shown) -> Bars:
    def column(name: str) -> np.ndarray:
        return np.array([row[name] for row in rows], dtype=np.float64)

    unit = str(rows[0]["unit"])
    bracket = f" ({unit})" if shown.has_unit and unit not in UNITLESS else ""
    part = column(shown.part) if shown.part and shown.part in rows[0] else None
    keys = tuple(str(row["key"]) for row in rows)
    return Bars(f"{rows[0]['output']}{bracket}", keys, column(shown.value), column(shown.half_width), part)
