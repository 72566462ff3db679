"""Colours of run-outs, in steps that read as contours, and of the classes of outcomes."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.view.sweeps.found import Floats, FoundSweep, told_outcome

if TYPE_CHECKING:
    from matplotlib.colors import BoundaryNorm, Colormap

STEPS = 8  # of run-out, at most
RARE = 1.0  # percent at either end that share the colour of the last step
LEAST_SPAN_MM = 1.0
RUN_OUT_COLOURS = "viridis"  # distinguishable with every colour blindness, and in grey: brighter all the way
# The same holds of these: no two are nearer than 0.12 in brightness.
CLASS_COLOURS = ("#56B4E9", "#16325B", "#F4E27A", "#A05A8C", "#1B6B4A")
OTHER_COLOUR, FAILED_COLOUR = "#D9D9D9", "#FFFFFF"


@dataclass(frozen=True)
class Classes:
    """Numbers of classes by case, and their meaning: the measured one first, then the most frequent."""

    numbers: Floats  # (n,)
    labels: tuple[str, ...]
    colours: tuple[str, ...]


def run_out_scale(x_mm: Floats) -> "tuple[Colormap, BoundaryNorm]":
    """Return a map of colours in round steps over all but the rarest run-outs (mm)."""
    from matplotlib import colormaps  # noqa: PLC0415 - see style
    from matplotlib.colors import BoundaryNorm  # noqa: PLC0415
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415

    low, high = np.nanpercentile(x_mm, [RARE, 100.0 - RARE])
    spare = 0.5 * max(LEAST_SPAN_MM - (high - low), 0.0)
    edges = MaxNLocator(nbins=STEPS, steps=[1, 2, 2.5, 5, 10]).tick_values(low - spare, high + spare)
    colours = colormaps[RUN_OUT_COLOURS]
    return colours, BoundaryNorm(edges, colours.N, extend="both")


def classes_of(sweep: FoundSweep) -> Classes:
    """Return the outcomes of all cases as numbers; classes beyond the colours are taken together."""
    outcomes = sweep.outcomes
    order = _in_order(outcomes, sweep.measured.outcome)[: len(CLASS_COLOURS)]
    known = {outcome: number for number, outcome in enumerate(order)}
    other, failed = len(order), len(order) + 1
    numbers = np.array([failed if one is None else known.get(one, other) for one in outcomes], dtype=np.float64)
    names = [told_outcome(one) + (" (measured)" if one == sweep.measured.outcome else "") for one in order]
    names += ["others", "failed"]
    shares = [float((numbers == number).mean()) for number in range(len(names))]
    labels = tuple(f"{name}: {percent(share)}" for name, share in zip(names, shares, strict=True))
    return Classes(numbers, labels, (*CLASS_COLOURS[: len(order)], OTHER_COLOUR, FAILED_COLOUR))


def percent(share: float) -> str:
    """Write a share, never rounded to 0 or 100 % unless exact."""
    if 0.0 < share < 0.01:  # noqa: PLR2004 - one percent
        return f"{100.0 * share:.2g} %"
    return f"{min(round(100.0 * share), 99 if share < 1.0 else 100)} %"


def _in_order(outcomes: Sequence[tuple[int, ...] | None], measured: tuple[int, ...] | None) -> list[tuple[int, ...]]:
    counts = Counter(one for one in outcomes if one is not None)
    order = sorted(counts, key=lambda one: (-counts[one], one))
    if measured is None or measured not in counts:
        return order
    return [measured, *(one for one in order if one != measured)]
