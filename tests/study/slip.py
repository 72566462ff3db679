"""A small study, as somebody adds one: what a block on a slope comes to at some tilts."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar

from pydantic import BaseModel

from blocksim.options import silent
from blocksim.scenario import Model
from blocksim.study.answer import Answer, Overview, Study
from blocksim.study.executors import Execution
from blocksim.study.rows import Row
from blocksim.study.sweep import Replay, runs_of
from blocksim.study.sweep_folder import FolderKind
from blocksim.view.style import Paper
from tests.study.plans import SQUAT, block_on_a_slope


class Point(BaseModel, frozen=True):
    """What the block came to at a tilt (deg)."""

    tilt: float
    outcome: str


class SlipAnswer(Answer, frozen=True):
    """All tilts."""

    files: ClassVar[FolderKind] = FolderKind("slip", "a study of slip", "slip", {r"slip\.csv": r"tilt \[deg\],outcome"})
    picture: ClassVar[str] = "steps"
    caption: ClassVar[str] = "What every tilt came to"
    points: tuple[Point, ...]

    def overview(self) -> Overview:
        """Return a row for every tilt."""
        rows = [(f"{one.tilt:g}", one.outcome) for one in self.points]
        return Overview(self.caption, ("tilt", "outcome"), rows, left=2)

    def draw(self, path: Path, title: str, paper: Paper) -> None:  # noqa: ARG002 - no picture at all
        """Write a text in place of a picture."""
        path.write_text(", ".join(f"{one.tilt}: {one.outcome}" for one in self.points))


def slip(
    tilts: Sequence[float],
    out: Path | str,
    execution: Execution | None = None,
    *,
    on_row: Callable[[float, Row], None] = silent,
) -> SlipAnswer:
    """Run a block at every tilt."""
    base, folder = Model(block_on_a_slope(SQUAT)), Path(out)
    name = "-".join(f"{tilt:g}" for tilt in tilts)
    with runs_of(base, base, folder, SlipAnswer.files, name, execution or Execution()) as runs:
        rows = runs.rows_of({tilt: {"ground.tilt": f"{tilt} deg"} for tilt in tilts}, on_row)
        points = tuple(Point(tilt=tilt, outcome=str(row["outcome"])) for tilt, row in rows.items())
        cells = [(one.tilt, one.outcome) for one in points]
        answer = SlipAnswer(points=points, folder=folder, run=runs.new, heads=("tilt [deg]", "outcome"), cells=cells)
        answer.write()
    return answer


def repeat_slip(answer: SlipAnswer, execution: Replay, out: Path) -> SlipAnswer:
    """Make it again."""
    return slip([one.tilt for one in answer.points], out, execution)


SLIP = Study(SlipAnswer, repeat_slip)
