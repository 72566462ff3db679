"""Pictures of sweeps: axes that can be read, points that are joined only where that is honest."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.view.series import MOST_ROWS, Typed, draw_series, is_smooth, moving_blocks, value_axis
from tests.view.made_up import HOSTILE, boxes_of, overlapping

Floats = NDArray[np.float64]


@dataclass
class MadeUp:
    label: str
    values: Floats
    x_mm: Floats


def made_up(blocks: int, label: str = "", runs: int = 11) -> MadeUp:
    """Return blocks of which the first stays and every further one goes farther with the value."""
    values = np.linspace(9.999e-3, 10.001e-3, runs)
    return MadeUp(label, values, 70.0 + np.linspace(-1.0, 1.0, runs)[:, None] * np.arange(blocks))


def test_svg_names_what_it_shows(tmp_path: Path) -> None:
    path = tmp_path / "series.svg"
    series = [made_up(3, "contact.restitution = 0.3"), made_up(3, "contact.restitution = 0.5")]
    draw_series(series, ("1", "2", "3"), ("overlap", "m"), path, title="jitter", measured={"2": (60.0, 75.0)})
    assert ET.parse(path).getroot().tag.endswith("svg")  # noqa: S314 - our own file
    text = path.read_text(encoding="utf-8")
    for told in (
        "jitter",
        "contact.restitution = 0.5",
        "overlap − 10 mm (µm)",
        "block 2: 69.00 to 71.00 mm, 2.00 mm apart",
    ):
        assert f"<!-- {told} -->" in text
    assert "Not shown: 1 of 3 blocks" in text
    assert "Band: smallest to largest" in text


@pytest.mark.parametrize("runs", [1, 2, 11])
def test_same_series_give_the_same_bytes(tmp_path: Path, runs: int) -> None:
    paths = [tmp_path / f"{name}.png" for name in ("first", "second")]
    for path in paths:
        draw_series([made_up(2, runs=runs)], ("a", "b"), ("gravity", "m/s^2"), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize(
    ("values", "unit", "label", "shown", "is_log"),
    [
        ([0.001, 0.1, 1.0], "", "key", [0.001, 0.1, 1.0], True),
        ([0.2, 0.3, 0.4], "", "key", [0.2, 0.3, 0.4], False),
        ([0.009, 0.010, 0.011], "m", "key (mm)", [9.0, 10.0, 11.0], False),
        ([0.0099995, 0.01, 0.0100005], "m", "key − 10 mm (nm)", [-500.0, 0.0, 500.0], False),
        ([60e9, 70e9], "Pa", "key (GPa)", [60.0, 70.0], False),
        ([0.0, np.pi / 6.0], "rad", "key (°)", [0.0, 30.0], False),
        ([-2e6, 2e6], "N/m", "key (10^6 N/m)", [-2.0, 2.0], False),
        ([3.0, 3.0], "", "key", [3.0, 3.0], False),
        ([0.0, 0.0], "s", "key (s)", [0.0, 0.0], False),
    ],
)
def test_axis_shows_values_so_that_they_can_be_read(
    values: list[float], unit: str, label: str, shown: list[float], is_log: bool
) -> None:
    axis = value_axis(np.array(values), "key", unit)
    assert (axis.label, axis.is_log) == (label, is_log)
    assert axis.shown(np.array(values)).tolist() == pytest.approx(shown, abs=1e-6)


@pytest.mark.parametrize(
    ("values", "typed", "label", "shown"),
    [
        ([0.09, 0.1, 0.12], Typed("cm", 0.01), "key (cm)", [9.0, 10.0, 12.0]),
        ([0.1, 3.1], Typed("mm", 0.001), "key (mm)", [100.0, 3100.0]),  # over decades
        ([0.9995, 1.0, 1.0005], Typed("cm", 0.01), "key − 100 cm (cm)", [-0.05, 0.0, 0.05]),
        ([0.0099995, 0.01, 0.0100005], Typed("mm", 0.001), "key − 10 mm (nm)", [-500.0, 0.0, 500.0]),
    ],
)
def test_axis_keeps_the_typed_unit(values: list[float], typed: Typed, label: str, shown: list[float]) -> None:
    axis = value_axis(np.array(values), "key", "m", typed=typed)
    assert axis.label == label
    assert axis.shown(np.array(values)).tolist() == pytest.approx(shown)


def test_only_smooth_series_are_joined() -> None:
    assert is_smooth(np.array([70.0, 70.5, 71.0, 70.9]))
    assert is_smooth(np.array([70.0, 70.001, 70.0, 70.002]))
    assert not is_smooth(np.array([70.0, 73.0, 70.0, 73.0]))


def test_blocks_that_stay_are_left_out_and_many_are_cut() -> None:
    assert moving_blocks([made_up(3)]) == [1, 2]
    assert moving_blocks([made_up(60)]) == list(range(60 - MOST_ROWS, 60))
    assert moving_blocks([made_up(1)]) == [0]


def test_unknown_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="unsupported picture format"):
        draw_series([made_up(2)], ("a", "b"), ("gravity", ""), tmp_path / "series.bmp")


NAMES = ("W" * 200, *HOSTILE)


@pytest.mark.parametrize("columns", [1, 2, 4])
@pytest.mark.parametrize("name", NAMES)
def test_long_and_hostile_names_cover_nothing(caught: list[Figure], columns: int, name: str) -> None:
    series, names = [made_up(3, name) for _ in range(columns)], ("1", name, "3")
    key = f"blocks.{name}.width", "m"
    draw_series(series, names, key, "series.png", title=name, measured={"3": (1.0, 2.0)})
    assert overlapping(caught[0]) == []


def test_short_names_are_whole(caught: list[Figure]) -> None:
    draw_series([made_up(3), made_up(3)], ("1", "2", "brick"), ("overlap", "m"), "series.png", title="a short title")
    texts = {text for text, _ in boxes_of(caught[0])}
    assert "a short title" in texts
    assert any(text.startswith("block brick: 68.00 to 72.00 mm, 4.00 mm apart") for text in texts)
    assert not any("…" in text for text in texts)


def test_headings_of_narrow_columns_keep_their_values(caught: list[Figure]) -> None:
    series = [made_up(3, f"friction.block_block.kinetic = 0.{number}") for number in range(4)]
    draw_series(series, ("1", "2", "3"), ("gravity", ""), "series.png")
    texts = [text for text, _ in boxes_of(caught[0])]
    assert [sum(text.endswith(f" = 0.{number}") for text in texts) for number in range(4)] == [1, 1, 1, 1]
