"""The kinds of pictures of runs and of sweeps, by name; a kind is one file and one line here."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from blocksim.errors import InvalidInputError
from blocksim.scenario.spelling import nearest
from blocksim.simulation.trajectory import Frames
from blocksim.view import final, history, scene, strip, style, thrust
from blocksim.view.sweeps import data, lines, outcome_map, scatter

STRIP, FINAL, HISTORY, PROFILE, THRUST = "strip", "final", "history", "profile", "thrust"
MOTION = "motion"  # of the supports; needs no run
PROBE = "probe"
CAPACITY = "capacity"  # of actuators
JOINTS = "joints"  # across structures
OF_RECORDS = (PROBE, CAPACITY, JOINTS)  # need no frames
RUN_KINDS: dict[str, Callable[[Frames, Path, scene.PictureOptions], None]] = {
    STRIP: strip.draw_strip,
    FINAL: final.draw_final,
    HISTORY: history.draw_history,
    PROFILE: strip.draw_profile,
    THRUST: thrust.draw_run_thrust,
}
MOST_SLIPS = 2


@dataclass(frozen=True)
class SweepPicture:
    """A kind of picture of a sweep: which sweeps it cannot show or suits best, and its drawing."""

    refusal: Callable[[data.SweepData], str]  # why it cannot show a sweep; empty where it can
    suits: Callable[[data.SweepData], bool]  # of those that it can show
    open: Callable[[data.SweepData, style.Paper], AbstractContextManager["style.Figure"]]

    def draw(self, sweep: data.SweepData, path: Path, paper: style.Paper = style.OWN) -> None:
        """Draw a sweep and write PNG, SVG or PDF; the same input gives the same bytes.

        Raises InvalidInputError for an unknown picture format or too small a page, OutputError.
        """
        path = style.picture_path(path)
        with self.open(sweep, paper) as figure:
            style.save_figure(figure, path)


SWEEP_KINDS = {  # by default the first that suits a sweep is drawn
    "lines": SweepPicture(lines.refusal, lines.suits, lines.draw_lines),
    "map": SweepPicture(outcome_map.refusal, outcome_map.suits, outcome_map.draw_map),
    "matrix": SweepPicture(lambda _: "", lambda sweep: len(sweep.inputs) > 1, scatter.draw_matrix),
    "histogram": SweepPicture(lambda _: "", lambda _: True, scatter.draw_histogram),
}


def run_kind(name: str) -> Callable[[Frames, Path, scene.PictureOptions], None]:
    """Return what draws pictures of a kind. Raises InvalidInputError for an unknown one."""
    if name not in RUN_KINDS:
        known = [*RUN_KINDS, MOTION, *OF_RECORDS]
        meant = nearest(name, known, MOST_SLIPS)
        hint = f"did you mean '{meant}'?" if meant else f"choose {', '.join(known)}"
        raise InvalidInputError(f"--kind {name}: unknown kind for a run, {hint}")
    return RUN_KINDS[name]
