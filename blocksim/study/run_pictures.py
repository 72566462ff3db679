"""Pictures of one run: what was stored, brought into the form that the view draws."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from blocksim.analysis.experiment import load_table
from blocksim.errors import InvalidInputError
from blocksim.options import Option, takes
from blocksim.scenario import load_scenario, load_stored
from blocksim.scenario.quantities import TIME, Quantity
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.own_files import refuse_foreign
from blocksim.simulation.stores.hdf5_probes import read_probes
from blocksim.study.compare import ExperimentTablePath
from blocksim.study.stored_run import Place, find_run, folder_of, stored_run
from blocksim.view.animation import Look, Pace, draw_animation, writer_of
from blocksim.view.history_panels import Choice
from blocksim.view.kinds import FINAL, HISTORY, MOTION, PROBE, PROFILE, STRIP, run_kind
from blocksim.view.motion import draw_support_motion
from blocksim.view.page_size import PageOptions
from blocksim.view.paint import COLOURS, paint_named
from blocksim.view.probes import draw_probes
from blocksim.view.run_data import support_of

LOOKS = {  # options of the pictures of runs, by field: their flag, and what they do
    "times": ("--at", "selects frames of a run's strip, final picture or profile"),
    "frames": ("--frames", "sets the number of panels of a run's strip"),
    "panels": ("--panels", "selects the panels of a run's history"),
    "blocks": ("--block", "selects the blocks of a run's history"),
    "relative": ("--relative", "plots a run's history relative to the ground"),
    "probes": ("--probe", "selects the probes of a run"),
    "forces": ("--forces", "shows contacts of a run"),
    "colour": ("--colour", "colours the blocks of a run"),
}
MEANT = {  # the kinds that have them
    STRIP: ("times", "frames", "forces", "colour"),
    FINAL: ("times", "forces", "colour"),
    PROFILE: ("times", "forces", "colour"),
    HISTORY: ("panels", "blocks", "relative", "forces", "colour"),
    PROBE: ("probes",),
}
MOST_SHOWN = 40  # letters of a value in a message


def _names(text: str) -> tuple[str, ...]:
    """Return names separated by commas. Raises ValueError for an empty list."""
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if not names:
        raise ValueError("give one name or several, separated by commas")
    return names


def _moments(text: str) -> tuple[float, ...]:
    """Return times in s, separated by commas, with or without their unit. Raises ValueError."""
    return tuple(map(_seconds, text.split(",")))


def _seconds(text: str) -> float:
    with suppress(ValueError):
        return float(text)
    with suppress(ValueError):
        return Quantity(TIME, above=0.0).read(text)
    example = "give seconds, separated by commas, such as 0,0.1,0.355 or '20 ms'"
    raise ValueError(f"{text.strip()[:MOST_SHOWN]!r} is not a time; {example}")


def _colour(text: str) -> str:
    """Return a way to colour blocks. Raises ValueError for an unknown one."""
    if text not in COLOURS:
        raise ValueError(f"{text[:MOST_SHOWN]!r} is unknown; choose {', '.join(COLOURS)}")
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
Replace = Annotated[bool, Option("Replace a file that blocksim did not write.")]


MEANT = {
    STRIP: ("--at", "--frames", "--forces", "--colour"),
    FINAL: ("--at", "--forces", "--colour"),
    PROFILE: ("--at", "--forces", "--colour"),
    HISTORY: ("--panels", "--block", "--relative", "--forces", "--colour"),
    PROBE: ("--probe",),
}
"""Options of each kind of picture of a run; that of the motion has none."""


@dataclass(frozen=True)
class PlotOptions(PageOptions):
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
            "Of a run: strip (default), final, history, profile (the surface of soil), motion (of the supports) or "
            "probe. Of a sweep: lines, map (two inputs), matrix (every two inputs) or histogram; tornado for "
            "sensitivities (default: what suits).",
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
    experiment: ExperimentTablePath = None
    forces: Forces = False
    overwrite: Replace = False

    def refuse(self, kind: str | None, what: str) -> None:
        """Raise InvalidInputError for an option that was given and means nothing for a kind of picture."""
        for name, (flag, meaning) in LOOKS.items():
            if name not in MEANT.get(kind or "", ()) and getattr(self, name) != getattr(PlotOptions, name):
                raise InvalidInputError(f"{flag} {meaning}, but {what}")

    def picture(self, default: str) -> Path:
        """Return the path of the picture. Raises OutputExistsError, OutputError where it may not go there."""
        path = Path(self.out or default)
        self.ready(path)
        return path

    def ready(self, path: Path) -> None:
        """Raise OutputExistsError, OutputError where a picture may not be written."""
        refuse_foreign(path, overwrite=self.overwrite)

    @property
    def table(self) -> Path | None:
        """The experiment table."""
        return None if self.experiment is None else Path(self.experiment)


def draw_run(run: Path, options: PlotOptions, kind: str) -> tuple[Path, str]:
    """Draw a run; return the picture's path (default: NAME.png or NAME_KIND.png) and a remark on an unfinished run.

    Raises InvalidInputError for an unknown kind or format and options that mean nothing for it, what `stored_run`
    and `PlotOptions.picture` raise, OutputError.
    """
    draw = run_kind(kind)
    options.refuse(kind, f"this picture is of kind {kind}")
    stored = stored_run(run)
    scenario = stored.scenario
    table = options.table or (scenario.experiment.table if scenario.experiment is not None else None)
    measured = None if table is None else load_table(table)
    picture = options.picture(f"{scenario.name}.png" if kind == STRIP else f"{scenario.name}_{kind}.png")
    chosen: dict[str, Any] = {"times": options.times}
    if kind == HISTORY:
        names = tuple(options.panels or ()), tuple(options.blocks or ())
        chosen = {"choice": Choice(*names, options.relative)}
    elif kind == STRIP:
        chosen["count"] = options.frames
    draw(
        stored.frames,
        picture,
        title=scenario.name,
        measured=measured,
        support=support_of(scenario, stored.events),
        forces=options.forces,
        paint=paint_named(options.colour, stored.frames, scenario),
        paper=options.paper,
        **chosen,
    )
    return picture, stored.remark


def draw_probes_of(place: Path, options: PlotOptions) -> tuple[Path, str]:
    """Draw the probes of a run, all or those that are named; return as `draw_run`.

    Raises what `stored_run`, reading the probes and `draw_probes` raise.
    """
    stored = stored_run(place)
    picture = options.picture(f"{stored.scenario.name}_{PROBE}.png")
    probes = read_probes(stored.folder / files.FRAMES, stored.scenario)
    draw_probes(probes, picture, f"{stored.scenario.name}: probes", tuple(options.probes or ()), options.paper)
    return picture, stored.remark


def draw_motion_of(place: Path, options: PlotOptions) -> Path:
    """Draw how the supports of a run or of a scenario file move, which need not have been run; return the picture.

    Raises what loading the scenario and `draw_support_motion` raise.
    """
    if place.is_file():
        scenario = load_scenario(place)
    else:
        scenario = load_stored(find_run(place, needed=(files.SCENARIO,)) / files.SCENARIO)
    picture = options.picture(f"{scenario.name}_{MOTION}.png")
    support = support_of(scenario)
    draw_support_motion(support, scenario.time.end, picture, f"{scenario.name}: motion", options.paper)
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


class Film(NamedTuple):
    """An animation that was written."""

    path: Path
    is_replaced: bool  # an older one
    pictures: int
    beyond: str  # which blocks leave the view
    remark: str  # on an unfinished run


def draw_film(place: Path, options: AnimateOptions) -> Film:
    """Write a run as an animation; see `animate`."""
    if options.out is not None:
        writer_of(Path(options.out))
    stored = stored_run(place)
    scenario = stored.scenario
    path = Path(options.out or f"{scenario.name}.gif")
    refuse_foreign(path, overwrite=options.overwrite)
    is_replaced = path.exists()
    paint = paint_named(options.colour, stored.frames, scenario)
    look = Look(options.width, options.trails, scenario.name, options.forces, paint)
    support, pace = support_of(scenario, stored.events), Pace(options.speed, options.fps)
    count, beyond = draw_animation(stored.frames, path, pace, look, support, options.on_picture)
    return Film(path, is_replaced, count, beyond, stored.remark)


@takes(AnimateOptions)
def animate(place: Place, options: AnimateOptions) -> Path:
    """Write a run as an animation, GIF or MP4, and return its path (default: NAME.gif in the current folder).

    Raises as `plot` does, and UnavailableError where nothing can write MP4.
    """
    return draw_film(folder_of(place), options).path
