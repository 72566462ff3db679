"""Pictures of one run: what was stored, brought into the form that the view draws."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blocksim.analysis.experiment import load_table
from blocksim.errors import InvalidInputError
from blocksim.scenario import load_scenario, load_stored
from blocksim.simulation import folder as files
from blocksim.simulation.stores.hdf5_probes import read_probes
from blocksim.study.stored_run import find_run, stored_run
from blocksim.view.history_panels import Choice
from blocksim.view.kinds import FINAL, HISTORY, MOTION, PROBE, PROFILE, STRIP, run_kind
from blocksim.view.layout import Paper
from blocksim.view.motion import draw_support_motion
from blocksim.view.paint import paint_named
from blocksim.view.probes import draw_probes
from blocksim.view.run_data import support_of

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


def draw_run(
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
