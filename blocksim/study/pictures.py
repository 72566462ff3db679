"""What `plot` draws: runs, sweeps, studies and tables of sensitivities, read back from where they lie."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from blocksim.analysis.compare import limits, prediction_half_width
from blocksim.analysis.curves import load_curves
from blocksim.analysis.evidence import Members
from blocksim.analysis.experiment import ExperimentTable, has_curves, load_table
from blocksim.errors import InputMissingError, InvalidInputError, Problem
from blocksim.options import Option, Replace, silent, takes
from blocksim.scenario import Model, Scenario, input_files, load_scenario, overrides, spelling, units
from blocksim.scenario.models.study import Normal, Uniform, Variation
from blocksim.simulation import files
from blocksim.study import answer, capacity, compare, manifest, run_folder, sweep_folder
from blocksim.study.rows import FINISHED, TABLE, Head, Ranges, X, quarter_turns
from blocksim.view import animation, joint_panels, paints, run_data, scene, studies, style, time_panels
from blocksim.view.kinds import (
    CAPACITY,
    FINAL,
    HISTORY,
    JOINTS,
    MOTION,
    OF_RECORDS,
    PROBE,
    PROFILE,
    STRIP,
    SWEEP_KINDS,
    THRUST,
    run_kind,
)
from blocksim.view.sweeps.data import Input, InputUnit, Measurements, SweepData

if TYPE_CHECKING:
    import pandas as pd


LARGEST = 1e30  # of inputs (SI) and of places (mm) that are drawn


def read_sweep_data(folder: Path, experiment: Path | str | None = None) -> SweepData:
    """Return what a sweep's folder holds, beside the scenario's experiment or another table.

    Raises InputMissingError or InvalidInputError: where files are missing or damaged, no case has finished, or the
    table measures what the sweep does not have.
    """
    sweep = manifest.read_sweep(folder)
    table = sweep.table
    scenario = Model.stored(folder / sweep_folder.PLAN).scenario
    blocks = tuple(name.removesuffix(X) for name in map(str, table.columns) if name.endswith(X))
    finished = (table["status"] == FINISHED).to_numpy(dtype=bool)
    if not blocks or not finished.any():
        raise InvalidInputError(f"{folder}: no case of this sweep has finished; nothing to draw")
    members = Members(table, str(folder / TABLE))
    x_mm, rotation_deg = (
        np.stack([members.values(block, quantity) for block in blocks], axis=1) for quantity in ("x", "rotation")
    )
    if max(np.nanmax(np.abs(one), initial=0.0) for one in (x_mm, rotation_deg)) > LARGEST:
        raise InvalidInputError(f"{members.source}: a block has moved too far to be drawn")
    is_cut = finished & ~np.isfinite(x_mm + rotation_deg).all(axis=1)
    if is_cut.any():  # it has neither ended nor failed
        case = table["case"].iloc[int(np.argmax(is_cut))]
        raise InvalidInputError(f"{members.source}: case {case} has finished, but its row lacks positions of blocks")
    path = experiment or (None if scenario.experiment is None else scenario.experiment.table)
    vary = {} if scenario.sweep is None else scenario.sweep.vary
    heads = [head for name in table.columns if (head := Head.read(str(name))).key in vary]
    missing = [key for key in vary if key not in {head.key for head in heads}]
    if missing or not heads:
        message = f"{TABLE} has no column {missing[0]}" if missing else f"{sweep_folder.PLAN} varies no key"
        raise InvalidInputError(f"{message}; table and plan do not belong together")
    inputs = [_input(scenario, head, table[str(head)], vary[head.key]) for head in heads]
    return SweepData(
        title=f"{sweep.progress} cases: " * bool(sweep.missing) + (scenario.description or scenario.name),
        mode="" if scenario.sweep is None else scenario.sweep.mode,
        inputs=tuple([one for one in inputs if one.count > 1] or inputs[:1]),
        blocks=blocks,
        x_mm=x_mm,
        rotation_deg=rotation_deg,
        finished=finished,
        inside=None if path is None else Ranges.read(path).inside(table).to_numpy(dtype=bool) & finished,
        measured=Measurements() if path is None else measurements_of(load_table(path), blocks),
        manners=tuple(table["outcome"].fillna("").astype(str)) if "outcome" in table.columns else (),
    )


def measurements_of(table: ExperimentTable, blocks: tuple[str, ...]) -> Measurements:
    """Return repeats and prediction intervals of x (mm), and the measured class where all rotations are measured."""
    means = {row.block: row.mean for row in table.summaries() if row.quantity == "rotation"}
    turned = quarter_turns([means[block] for block in blocks if block in means])
    rows = [row for row in table.summaries() if row.quantity == "x" and row.block in blocks]
    return Measurements(
        x_mm={row.block: table.values(row.block, "x").to_numpy(dtype=float) for row in rows},
        limits_mm={row.block: limits("x", row.mean, row.minimum, row.maximum) for row in rows},
        prediction_mm={
            row.block: (row.mean - half, row.mean + half)
            for row in rows
            if (half := prediction_half_width(row.s, row.n)) > 0.0
        },
        outcome=turned if len(turned) == len(blocks) else None,
    )


def _input(scenario: Scenario, head: Head, column: "pd.Series", vary: Variation) -> Input:
    """Return the values of a key in SI, or the numbers of its words; in the table they stand as they were given."""
    numbers = []
    for value in column:
        for read in (float, lambda text: units.parse_quantity(text, units.NUMBER)[0]):
            with suppress(ValueError):
                numbers.append(read(str(value)))
                break
    factor = float(units.parse_unit(head.unit).factor) if head.unit else 1.0
    values = np.array(numbers, dtype=np.float64) * factor
    if not (np.abs(values) <= LARGEST).all():
        raise InvalidInputError(f"{TABLE}: the column {head.key} holds values that are not numbers or too large")
    if len(values) == len(column):
        typed = InputUnit(head.unit, factor) if head.unit else None
        is_even = isinstance(vary, Normal) or (isinstance(vary, Uniform) and vary.scale == "linear")
        unit = unit_of(scenario, head.key) or ("rad" if head.is_angle else "")
        return Input(head.key, unit, values, is_even=is_even, typed=typed)
    words = [units.toml(value).strip('"') for value in column]
    levels = tuple(dict.fromkeys(words))
    return Input(head.key, "", np.array([levels.index(word) for word in words], dtype=np.float64), levels)


def unit_of(scenario: Scenario, key: str) -> str:
    """Return the SI unit of a key's values, empty for plain numbers."""
    field = overrides.field_of(key, scenario)
    return "" if field is None else overrides.si_unit(field)


TORNADO = "tornado"
LARGEST_FILE = 10_000_000  # bytes
HEAD = ("output", "unit", "key")
UNITLESS = ("share", "")


@dataclass(frozen=True)
class IndexColumns:
    """The columns of a method that a picture shows, what the bars mean, and what their dark parts do."""

    value: str
    half_width: str
    part: str
    labels: tuple[str, str]
    has_unit: bool


METHODS = (
    IndexColumns(
        "ST", "± ST", "S1", ("total share of the variance, 95 % interval", "share of the key alone"), has_unit=False
    ),
    IndexColumns("mu*", "±", "", ("mean change over a key's range, 95 % interval", ""), has_unit=True),
)


def read_indices(path: Path) -> tuple[list[studies.Bars], tuple[str, str]]:
    """Return the bars of every result and what they mean.

    Raises InputMissingError or InvalidInputError, with every mistake located.
    """
    table = input_files.read_table(path, limit=LARGEST_FILE)
    names = [head.text for head in table.heads]
    shown = next((one for one in METHODS if {*HEAD, one.value, one.half_width} <= set(names)), None)
    if shown is None:
        message = "not the table of `blocksim sensitivity --out`: no columns output, unit, key and ST or mu*"
        input_files.raise_problems([table.header.problem(message)])
    rows = [{name: _read(cell, table.problems) for name, cell in row.items()} for row in table.rows]
    if table.problems:
        input_files.raise_problems(table.problems)
    if not rows:
        raise InvalidInputError(f"{path}: no result varies; nothing to draw")
    return bars_of(rows, shown), shown.labels


def bars_of(rows: Sequence[Mapping[str, object]], shown: IndexColumns) -> list[studies.Bars]:
    """Return the bars of every result, of rows with output, unit, key and the columns of a method."""
    panels = []
    for output in dict.fromkeys(str(row["output"]) for row in rows):
        own = [row for row in rows if row["output"] == output]
        columns = {name: np.array([row[name] for row in own], dtype=np.float64) for name in own[0] if name not in HEAD}
        unit = str(own[0]["unit"])
        bracket = f" ({unit})" if shown.has_unit and unit not in UNITLESS else ""
        keys = tuple(str(row["key"]) for row in own)
        value, half_width = columns[shown.value], columns[shown.half_width]
        panels.append(studies.Bars(f"{output}{bracket}", keys, value, half_width, columns.get(shown.part)))
    return panels


def _read(cell: input_files.TableCell, problems: list[Problem]) -> str | float:
    """Return the text of a name or the number of an index; 0 after noting a problem."""
    if cell.column in HEAD:
        return cell.text
    try:
        return cell.number() if cell.text not in {"", "nan"} else float("nan")
    except ValueError as error:
        problems.append(cell.problem(str(error)))
        return 0.0


OF_SCENES = (STRIP, FINAL, PROFILE)
LOOKS = {  # options of the pictures of runs, by field: their flag, what they do, and the kinds that have them
    "times": ("--at", "selects frames of a run's strip, final picture, profile or thrust", (*OF_SCENES, THRUST)),
    "frames": ("--frames", "sets the number of panels of a run's strip", (STRIP,)),
    "panels": ("--panels", "selects the panels of a run's history", (HISTORY,)),
    "blocks": ("--block", "selects the blocks of a run's history", (HISTORY,)),
    "relative": ("--relative", "plots a run's history relative to the ground", (HISTORY,)),
    "probes": ("--probe", "selects the probes of a run", (PROBE,)),
    "forces": ("--forces", "shows contacts of a run", (*OF_SCENES, HISTORY)),
    "colour": ("--colour", "colours the blocks of a run", (*OF_SCENES, HISTORY)),
}
OLDER = "replaces an older file, "
MOST_SHOWN = 40  # letters of a value in a message


def _names(text: str) -> tuple[str, ...]:
    """Return names separated by commas. Raises ValueError for an empty list."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if not names:
        raise ValueError("give one name or several, separated by commas")
    return names


def _moments(text: str) -> tuple[float, ...]:
    """Return times in s, separated by commas, with or without their unit. Raises ValueError."""
    times = []
    for part in text.split(","):
        for read in (float, units.Quantity(units.TIME, above=0.0).read):
            with suppress(ValueError):
                times.append(read(part))
                break
        else:
            example = "give seconds, separated by commas, such as 0,0.1,0.355 or '20 ms'"
            raise ValueError(f"{part.strip()[:MOST_SHOWN]!r} is not a time; {example}")
    return tuple(times)


def _colour(text: str) -> str:
    """Return a way to colour blocks. Raises ValueError for an unknown one."""
    if text not in paints.COLOURS:
        raise ValueError(f"{text[:MOST_SHOWN]!r} is unknown; choose {', '.join(paints.COLOURS)}")
    return text


Colour = Annotated[
    str,
    Option(
        "Colour blocks by block, material, speed or turn; soil by displacement (default), speed, plastic or pressure.",
        flags=("--colour", "--color"),
        metavar="BY",
        read=_colour,
        complete="colours",
    ),
]
Forces = Annotated[bool, Option("Draw contact forces, if the run has stored them.")]


@dataclass(frozen=True)
class PlotOptions(style.PageOptions):
    """What is drawn of a run, a sweep, a study or a table, how, and where."""

    out: Annotated[
        Path | str | None,
        Option("Picture to write: .png, .svg or .pdf.", metavar="FILE"),
    ] = None
    _: KW_ONLY
    times: Annotated[
        Sequence[float] | None,
        Option(
            "Times of the panels in s, as printed above them (default: by motion); of a final picture, one.",
            flags=("--at", "--times"),
            metavar="T,T,...",
            read=_moments,
        ),
    ] = None
    kind: Annotated[
        str | None,
        Option(
            "Of a run: strip (default), final, history, profile (the surface of soil), motion (of the supports), "
            "joints (factors of safety), probe or capacity (of actuators). Of a sweep: lines, map (two inputs), "
            "matrix (every two inputs) or histogram; tornado for sensitivities (default: what suits).",
            metavar="KIND",
            complete="kinds",
        ),
    ] = None
    frames: Annotated[int | None, Option("Panels of a strip (default: 6 to 8).", metavar="N", least=2, most=60)] = None
    panels: Annotated[
        Sequence[str] | None,
        Option(
            "Panels of a history: x, y, dx, dy, rotation, vx, vy, speed, spin, energy, contacts, force, ground; "
            "displacement is dx,dy and velocity vx,vy.",
            metavar="P,P,...",
            read=_names,
        ),
    ] = None
    blocks: Annotated[
        Sequence[str] | None,
        Option("Blocks of a history, by name.", flags=("--block",), metavar="N,N,...", read=_names),
    ] = None
    probes: Annotated[
        Sequence[str] | None,
        Option("Probes to draw, by name (default: all).", flags=("--probe",), metavar="N,N,...", read=_names),
    ] = None
    relative: Annotated[bool, Option("Plot a history relative to the moving ground.")] = False
    colour: Colour = "block"
    experiment: compare.ExperimentTablePath = None
    forces: Forces = False
    overwrite: Replace = False

    def refuse(self, kind: str | None, what: str) -> None:
        """Raise InvalidInputError for an option that was given and means nothing for a kind of picture."""
        for name, (flag, meaning, kinds) in LOOKS.items():
            if kind not in kinds and getattr(self, name) != getattr(PlotOptions, name):
                raise InvalidInputError(f"{flag} {meaning}, but {what}")

    def picture(self, default: str) -> Path:
        """Return the path of the picture.

        Raises InvalidInputError for an unknown format, OutputExistsError, OutputError where it may not go there.
        """
        path = style.picture_path(self.out or default)
        files.refuse_foreign(path, overwrite=self.overwrite)
        return path


def draw_run(find: Callable[[], run_folder.StoredRun], options: PlotOptions) -> tuple[Path, str]:
    """Draw a run, or its probes; return the picture's path and a remark on an unfinished run.

    The path is by default NAME.png or NAME_KIND.png. Raises InvalidInputError for an unknown kind or format and options
    that mean nothing for it, what `find` and `PlotOptions.picture` raise, OutputError.
    """
    kind = options.kind or STRIP
    draw = None if kind in OF_RECORDS else run_kind(kind)
    options.refuse(kind, f"this picture is of kind {kind}")
    stored = find()
    scenario = stored.model.scenario
    table = options.experiment or (scenario.experiment.table if scenario.experiment is not None else None)
    curves = load_curves(table) if table is not None and has_curves(table) else None
    measured = None if table is None or curves is not None or draw is None else load_table(table).summaries()
    picture = options.picture(f"{scenario.name}.png" if kind == STRIP else f"{scenario.name}_{kind}.png")
    if kind == CAPACITY:
        capacity.draw_capacity(scenario, stored.probes(), curves, picture, options.paper)
        return picture, stored.remark
    if kind == JOINTS:
        joint_panels.draw_joints(stored.joints, picture, f"{scenario.name}: joints", options.paper)
        return picture, stored.remark
    if draw is None:
        time_panels.draw_probes(
            stored.probes(), picture, f"{scenario.name}: probes", tuple(options.probes or ()), options.paper
        )
        return picture, stored.remark
    asked = scene.PictureOptions(
        scenario.name,
        measured,
        run_data.support_of(stored.model, stored.events, stored.probes() if scenario.actuators else {}),
        forces=options.forces,
        times=options.times,
        count=options.frames,
        panels=options.panels or (),
        blocks=options.blocks or (),
        relative=options.relative,
        paint=paints.paint_of(options.colour, stored.frames, stored.model),
        paper=options.paper,
    )
    draw(stored.frames, picture, asked)
    return picture, stored.remark


def draw_motion(find: Callable[[], Scenario], options: PlotOptions) -> Path:
    """Draw how the supports of a run or of a scenario file move, which need not have been run; return the picture.

    Raises what `find` and `draw_support_motion` raise.
    """
    options.refuse(MOTION, f"this picture is of kind {MOTION}")
    scenario = find()
    picture = options.picture(f"{scenario.name}_{MOTION}.png")
    support = run_data.support_of(Model(scenario))
    time_panels.draw_support_motion(support, scenario.time.end, picture, f"{scenario.name}: motion", options.paper)
    return picture


@dataclass(frozen=True)
class AnimateOptions:
    """How fast, how large and in what colours a run is shown, and where the film goes."""

    out: Annotated[Path | str | None, Option("Animation to write: .gif or .mp4.", metavar="FILE")] = None
    _: KW_ONLY
    speed: Annotated[
        float,
        Option("Simulated seconds per second of the animation.", metavar="FACTOR", least=1e-6, most=1e6),
    ] = 0.25
    fps: Annotated[float, Option("Frames per second; 50 in a GIF.", metavar="N", least=0.1, most=240.0)] = 30.0
    trails: Annotated[
        bool | None,
        Option("Paths of the centres (default: up to 30 blocks).", flags=("--trails/--no-trails",)),
    ] = None
    forces: Forces = False
    colour: Colour = "block"
    width: Annotated[int, Option("Width in pixels.", metavar="PX", least=200, most=4000)] = 800
    overwrite: Replace = False
    on_picture: Callable[[int, int], None] = silent


def draw_film(place: Path, options: AnimateOptions) -> tuple[Path, str, str]:
    """Write a run as an animation, see `animate`; return its path, what it is, and a remark on an unfinished run."""
    if options.out is not None:
        animation.writer_of(Path(options.out))
    stored = run_folder.read_run(place)
    path = Path(options.out or f"{stored.model.scenario.name}.gif")
    files.refuse_foreign(path, overwrite=options.overwrite)
    older = OLDER if path.exists() else ""
    count, beyond = animate_run(stored, path, options)
    return path, f"{older}{count} frames{f'; {beyond}' if beyond else ''}", stored.remark


def animate_run(stored: run_folder.StoredRun, path: Path, options: AnimateOptions) -> tuple[int, str]:
    """Write a run as an animation; return the number of frames, and which blocks leave the view."""
    scenario = stored.model.scenario
    paint = paints.paint_of(options.colour, stored.frames, stored.model)
    look = animation.Look(options.width, options.trails, scenario.name, options.forces, paint)
    support = run_data.support_of(stored.model, stored.events, stored.probes() if scenario.actuators else {})
    pace = animation.Pace(options.speed, options.fps)
    return animation.draw_animation(stored.frames, path, pace, look, support, options.on_picture)


@takes(AnimateOptions)
def animate(place: run_folder.Place, options: AnimateOptions) -> Path:
    """Write a run as an animation, GIF or MP4, and return its path (default: NAME.gif in the current folder).

    Raises as `plot` does, and UnavailableError where nothing can write MP4.

    >>> kept = run(load("scenarios/slide.toml", {"contact.stiffness_scale": 0.001}), out="results/kept")
    >>> animate(kept, "slide.gif", width=200, fps=5.0).name
    'slide.gif'
    """
    return draw_film(run_folder.folder_of(place), options)[0]


def _draw_sweep(folder: Path, options: PlotOptions) -> Path:
    """Draw a sweep, by default as the kind that suits it; return the picture's path (default: NAME.png).

    Raises what `read_sweep_data` raises, InvalidInputError for an unknown picture format or kind and for one that
    cannot show this sweep, OutputError.
    """
    kind = options.kind
    if kind == TORNADO:
        message = f"a {TORNADO} is drawn from a table of indices: blocksim sensitivity SCENARIO --out TABLE.csv"
        raise InvalidInputError(message)
    if kind is not None and kind not in SWEEP_KINDS:
        message = f"--kind {kind}: unknown kind, {spelling.did_you_mean_or_list(kind, [*SWEEP_KINDS, TORNADO])}"
        raise InvalidInputError(message)
    found = read_sweep_data(folder, options.experiment)
    suited = (name for name, picture in SWEEP_KINDS.items() if picture.suits(found))
    chosen = SWEEP_KINDS[kind or next(suited)]
    if kind is not None and (reason := chosen.refusal(found)):
        raise InvalidInputError(f"{folder}: {reason}")
    path = options.picture(f"{Model.stored(folder / sweep_folder.PLAN).scenario.name}.png")
    chosen.draw(found, path, options.paper)
    return path


@takes(PlotOptions)
def plot(place: run_folder.Place, options: PlotOptions) -> Path:
    """Draw a run, a sweep, a study or a table of sensitivities.

    `place` is a result that is kept in a folder, a sweep, or what the command takes. Returns the path of the picture
    (default: NAME.png in the current folder). Raises InvalidInputError for an unknown kind or format, too small a page
    and a result that was not kept, InputMissingError, OutputExistsError for a file of others unless `overwrite`,
    OutputError.

    >>> kept = run(load("scenarios/slide.toml", {"contact.stiffness_scale": 0.001}), out="results/kept")
    >>> plot(kept, "slide.svg", kind="final").name
    'slide.svg'
    """
    if isinstance(place, answer.UnstoredResult):
        return answer.draw_result(place, options)
    return draw(run_folder.folder_of(place), options)[0]


def draw(place: Path, options: PlotOptions) -> tuple[Path, str]:
    """Draw what lies at a place, see `plot`; return the picture's path and a remark on an unfinished run."""
    if not place.exists():
        raise InputMissingError(f"{place}: no such run folder, sweep folder, table or scenario file")
    study = answer.study_in(place)
    if study is not None:
        options.refuse(None, f"{place} is {study.answer.files.what}")
        return answer.draw_study(place, study, options), ""
    if manifest.is_sweep(place):
        options.refuse(None, f"{place} is a sweep")
        return _draw_sweep(place, options), ""
    if place.suffix.lower() == ".csv":
        options.refuse(None, f"{place} is a table")
        if options.kind not in {None, TORNADO}:
            raise InvalidInputError(f"{place}: a table of indices is drawn as {TORNADO!r}, not as {options.kind!r}")
        panels, labels = read_indices(place)
        path = options.picture(f"{place.stem}.png")
        studies.draw_tornado(panels, labels, path, title="Which inputs matter", paper=options.paper)
        return path, ""
    if options.kind == MOTION:

        def scenario() -> Scenario:
            if place.is_file():
                return load_scenario(place)
            return Model.stored(run_folder.find_run(place, needed=(files.SCENARIO,)) / files.SCENARIO).scenario

        return draw_motion(scenario, options), ""
    return draw_run(lambda: run_folder.read_run(place), options)
