"""Figures in words, for golden files: what is written, how far axes reach, where lines and areas are."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from tests.view.made_up import texts_in

CORNERS = 12  # of areas, and ends of lines, that are told one by one
MOST = 6  # lines and colours that are told one by one


def described(figure: Figure) -> str:
    """Return a figure as text, with numbers of four digits: the page in inches, all else in the units of its axes."""
    page = figure.get_size_inches()
    lines = [f"page {_numbers(page)} in", *_written(figure.texts)]
    for axes in figure.axes:
        place = _numbers(np.array(axes.get_position().bounds) * [*page, *page])
        x, y = (_numbers(limits) for limits in (axes.get_xlim(), axes.get_ylim()))
        lines += [f"axes at {place} in: {axes.get_xscale()} x {x}, {axes.get_yscale()} y {y}"]
        lines += [*_written(texts_in(axes)), *(f"  {line}" for line in _drawn(axes))]
    return "\n".join(lines)


def _written(texts: Iterable[Text]) -> list[str]:
    words = [repr(text.get_text())[1:-1] for text in texts if text.get_text()]
    return [f"  {' | '.join(words)}"] if words else []


def _drawn(axes: Axes) -> list[str]:
    told = [
        f"line {to_hex(line.get_color())} {line.get_linestyle()} {_marker(line)} z{line.get_zorder():g}: "
        f"{_way(line.get_xydata())}"
        for line in axes.lines[:MOST]
    ]
    if len(axes.lines) > MOST:
        told.append(f"{len(axes.lines) - MOST} more lines")
    told += [_parts(one) for one in axes.collections if one.get_paths() and len(np.atleast_2d(one.get_offsets()))]
    return told + [_area(one) for one in axes.patches]


def _marker(line: Line2D) -> str:
    has_none = line.get_marker() in {"None", "", None}
    return "None" if has_none else f"{line.get_marker()} of {line.get_markersize():g} points"


def _area(patch: Patch) -> str:
    """Return the colour of an area, and its corners or the box around many."""
    path = patch.get_path()
    corners = patch.get_patch_transform().transform(np.asarray(path.vertices))
    look = f"{type(patch).__name__} {to_hex(patch.get_facecolor())} edge {patch.get_linewidth():.3g}"
    return f"{look}: {' '.join(map(_numbers, corners)) if len(corners) <= CORNERS else _way(corners)}"


def _parts(parts: Collection) -> str:
    """Return how many parts a collection has, their colours and the box that they fill; dots: that of their places."""
    paths, places = parts.get_paths(), np.atleast_2d(np.ma.filled(parts.get_offsets(), np.nan))
    points = places if len(places) > 1 else np.concatenate([path.vertices for path in paths])
    colours = parts.get_edgecolor() if isinstance(parts, LineCollection) else parts.get_facecolor()
    names = list(dict.fromkeys(to_hex(colour) for colour in np.asarray(colours)))
    shown = " ".join(names[:MOST]) + f" and {len(names) - MOST} more" * (len(names) > MOST)
    points = points[np.isfinite(points).all(axis=1)]
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else ((), ())
    count = len(places) if len(places) > 1 else len(paths)
    widths = " ".join(f"{width:.3g}" for width in dict.fromkeys(np.atleast_1d(parts.get_linewidth()).tolist()))
    told = f"{count} {type(parts).__name__} {shown}{f' {parts.get_hatch()}' if parts.get_hatch() else ''} edge {widths}"
    if len(places) > 1 or len(points) > CORNERS:
        return f"{told} in {_numbers([*low, *high])}"
    return f"{told}: {'; '.join(' '.join(map(_numbers, np.asarray(path.vertices))) for path in paths)}"


def _way(points: Any) -> str:
    """Return the first and the last point, and the box around all of them."""
    places = np.asarray(points, dtype=float)
    if len(places) < 2:
        return f"{len(places)} point at {_numbers(places.ravel())}"
    low, high = np.nanmin(places, axis=0), np.nanmax(places, axis=0)
    box = f", in {_numbers([*low, *high])}" if len(places) > 2 else ""
    return f"{len(places)} points, {_numbers(places[0])} to {_numbers(places[-1])}{box}"


def _numbers(values: Iterable[Any]) -> str:
    return "(" + ", ".join(f"{0.0 if abs(value) < 1e-9 else value:.4g}" for value in map(float, values)) + ")"
