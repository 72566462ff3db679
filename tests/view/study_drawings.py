"""Pictures of studies, probes and motions, drawn from made-up data: (path, paper) of each by name."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.scenario.motion import motion_pieces
from blocksim.simulation.instruments import COLUMNS, ENERGY, ProbeSeries, series_of
from blocksim.view.kinds import SWEEP_KINDS
from blocksim.view.run_data import Support
from blocksim.view.studies import (
    Band,
    Bars,
    Fragility,
    LimitCurve,
    LimitRange,
    OtherLimits,
    TrialPanel,
    draw_fragility,
    draw_levels,
    draw_limit_curve,
    draw_tornado,
    draw_trials,
    places,
)
from blocksim.view.style import Paper
from blocksim.view.sweeps.data import Input
from blocksim.view.time_panels import draw_probes, draw_support_motion
from tests.scenario.test_motion import END, scenario
from tests.view.drawings import KEYS, Drawing, panel
from tests.view.made_up_sweeps import grid, made_up

OTHERS = (
    OtherLimits("curve of a book", tuple((0.1 * number, 2.0 - 0.1 * number) for number in range(13))),
    OtherLimits("values of a paper", ((0.1, 1.9), (0.6, 1.4))),
)
RANGE = [(0.3, [LimitRange(1.6, 1.8, "falls", "stands")])]
LIMITS = LimitCurve("friction", "thickness (m)", RANGE, ("Stands means: outcome == stands.",), OTHERS)
PULSE = {"kind": "pulse", "shape": "rectangular", "amplitude": "0.5 g", "duration": 0.1, "start": 0.2}
LONG_KEY = "pairs.very_hard_granite_of_the_quarry.very_soft_rubber_of_the_mat.restitution"
LONG_KEYS = (LONG_KEY, LONG_KEY.replace("restitution", "static"), "contact.particle_spacing_of_the_boundary_layer")
LONG_WORDS = ("nonsmooth_contacts", "explicit_with_springs")
HARDLY_KNOWN = Bars("x of block 2 (mm)", LONG_KEYS, np.array([3.0, 2.0, 1.0]), np.array([9.0, 0.5, 0.1]))


def fragility(x: tuple[float, ...] = (0.2, 0.4, 0.6), *, with_curve: bool = True, most: float = 1.0) -> Fragility:
    """Return shares of failures that rise to `most`."""
    at = places(np.array(x))
    rising, share = np.linspace(0.1, 0.9, len(at)), most * np.linspace(0.0, 1.0, len(x))
    band = Band(at, rising, rising - 0.1, rising + 0.1) if with_curve else None
    low, high = 0.8 * share, share + 0.2 * (1.0 - share)
    return Fragility("motion.scale", "", np.array(x), share, low, high, band, ("A note.",))


def probe(kind: str, count: int = 5) -> ProbeSeries:
    """Return a probe of a kind whose values are those of nothing."""
    columns = dict.fromkeys(("kinetic", "potential", "friction"), "J") if kind == ENERGY else COLUMNS[kind]
    rows = [(step, [1e3 * (step + 1.0) * (place + 1) for place in range(len(columns))]) for step in range(count)]
    return series_of(kind, kind, columns, rows, 0.1)


def knocked() -> ProbeSeries:
    """Return a force with one sample that is far above all others."""
    series = probe("force", 200)
    series.columns["fx"][:], series.columns["fy"][:] = 1.0, -20.0
    series.columns["fy"][77] = -5000.0
    return series


def of_fragility(**values: Any) -> Drawing:
    return lambda path, paper: draw_fragility(fragility(**values), path, "A study", paper)


def of_long_names(kind: str, *, size: tuple[float, float] | None = None) -> Drawing:
    """Return a picture of a sweep over a key and words that are long."""
    friction, scale, word = grid(2)
    values, which = np.tile(np.linspace(0.1, 0.3, 6), 2), np.repeat([0.0, 1.0], 6)
    two = (Input(LONG_KEY, "m", values), Input("time.scheme", "", which, LONG_WORDS))
    three = (replace(friction, key=LONG_KEY), scale, replace(word, levels=LONG_WORDS))
    sweep = made_up(two if kind == "lines" else three)
    return lambda path, _: SWEEP_KINDS[kind].draw(sweep, path, Paper(size))


def of_bars(*bars: Bars, size: tuple[float, float] | None = None) -> Drawing:
    return lambda path, _: draw_tornado(list(bars), ("mean change", ""), path, "Which inputs matter", Paper(size))


def of_trials(*keys: str, is_log: bool = False) -> Drawing:
    """Return a picture of twelve trials, the best one in colour, over each key from 0.1 to 10."""
    values = np.geomspace(0.1, 10.0, 12)
    scores = np.exp(-((np.log(values) - 0.3) ** 2)).round(1)
    panels = [TrialPanel(key, values, (0.1, 10.0), is_log=is_log) for key in keys]
    return lambda path, paper: draw_trials(panels, scores, scores == scores.max(), "share inside", path, "fit", paper)


def of_probes(*probes: ProbeSeries) -> Drawing:
    return lambda path, paper: draw_probes({one.name: one for one in probes}, path, "run: probes", paper=paper)


def motion(path: Path, paper: Paper) -> None:
    draw_support_motion(Support(motion=motion_pieces(scenario(PULSE))), END, path, "pulse", paper)


NINE = (9.0, 9.0)
STUDIES: dict[str, Drawing] = {
    "levels of sixty blocks": lambda path, paper: draw_levels([panel(60)], path, title="slide", paper=paper),
    "levels of nothing that moves": lambda path, paper: draw_levels([panel(size_mm=0.0)], path, paper=paper),
    "levels of little": lambda path, paper: draw_levels(
        [panel(size_mm=1e-6), panel(size_mm=20.0)], path, measured={"b1": 50.0}, paper=paper
    ),
    "trials of four keys": of_trials(
        "contact.restitution", "friction.block_block.kinetic", "gravity", "ground.tilt (deg)"
    ),
    "trials of one key": of_trials("contact.stiffness_scale", is_log=True),
    "tornado of nothing": of_bars(Bars("x", KEYS, np.zeros(3), np.zeros(3))),
    "tornado of both signs": of_bars(Bars("x", KEYS, np.array([0.2, -0.7, 0.1]), np.zeros(3))),
    "tornado with long keys": of_bars(HARDLY_KNOWN, HARDLY_KNOWN),
    "small tornado with long keys": of_bars(HARDLY_KNOWN, HARDLY_KNOWN, size=(4.0, 5.0)),
    "limits": lambda path, paper: draw_limit_curve(LIMITS, path, "An arch", paper),
    "fragility": of_fragility(),
    "fragility over decades": of_fragility(x=(0.1, 1.0, 10.0)),
    "fragility without a curve": of_fragility(with_curve=False),
    "fragility where few fail": of_fragility(with_curve=False, most=0.1),
    **{f"{kind} with long names": of_long_names(kind) for kind in ("lines", "map", "matrix", "histogram")},
    **{f"small {kind} with long names": of_long_names(kind, size=NINE) for kind in ("lines", "map", "matrix")},
    "probes of blocks": of_probes(probe("force"), probe("point")),
    "probes of joints and energy": of_probes(probe("joint"), probe(ENERGY)),
    "probe of an impact": of_probes(knocked()),
    "motion of the supports": motion,
}
