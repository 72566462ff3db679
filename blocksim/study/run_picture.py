"""Pictures of one run, as `blocksim plot` and `blocksim.plot` ask for them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blocksim.analysis.experiment import load_table
from blocksim.errors import InvalidInputError
from blocksim.study.stored import stored_run
from blocksim.view.curves import Choice
from blocksim.view.kinds import FINAL, HISTORY, STRIP, kind_named
from blocksim.view.paint import paint_named
from blocksim.view.paper import Paper
from blocksim.view.support import support_of

MEANINGS = {
    "--at": "picks frames of a run's strip or final picture",
    "--frames": "counts the panels of a run's strip",
    "--panels": "chooses the panels of a run's history",
    "--block": "chooses the blocks of a run's history",
    "--relative": "moves a run's history with the ground",
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

    def of_runs(self) -> list[str]:
        """Return the options that were given and mean nothing for a sweep."""
        forces, colour = {"--forces": self.forces}, {"--colour": self.colour != "block"}
        given = {**self._of_strips(), **self._of_histories(), **forces, **colour}
        return [option for option, is_given in given.items() if is_given]

    def beside(self, kind: str) -> list[str]:
        """Return the options that were given and mean nothing for a kind of picture."""
        meant = {STRIP: self._of_histories(), FINAL: {**self._of_histories(), "--frames": self.frames is not None}}
        return [option for option, is_given in meant.get(kind, self._of_strips()).items() if is_given]

    def arguments(self, kind: str) -> dict[str, Any]:
        """Return what a kind of picture is drawn with."""
        if kind == HISTORY:
            return {"choice": Choice(self.panels or (), self.blocks or (), self.relative)}
        return {"times": self.times, "count": self.frames} if kind == STRIP else {"times": self.times}

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
    draw = kind_named(kind)
    refuse(asked.beside(kind), f"this picture is of the kind {kind}")
    stored = stored_run(run)
    scenario = stored.scenario
    table = experiment or (scenario.experiment.table if scenario.experiment is not None else None)
    measured = None if table is None else load_table(table)
    picture = out or Path(f"{scenario.name}.png" if kind == STRIP else f"{scenario.name}_{kind}.png")
    ready(picture)
    look = {"title": scenario.name, "measured": measured, "support": support_of(scenario), "forces": asked.forces}
    paint = paint_named(asked.colour, stored.frames, scenario)
    draw(stored.frames, picture, **look, **asked.arguments(kind), paint=paint, paper=paper)
    return picture, stored.remark


def refuse(given: Sequence[str], what: str) -> None:
    """Raise InvalidInputError for options that mean nothing for what is drawn."""
    if given:
        message = f"{given[0]} {MEANINGS[given[0]]}, but {what}"
        raise InvalidInputError(message)
