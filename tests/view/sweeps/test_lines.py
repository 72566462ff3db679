"""Lines: a sweep taken apart into series, and drawn so that points are joined only where that is honest."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError
from blocksim.view.sweeps.data import MOST_ROWS, Input
from blocksim.view.sweeps.lines import Series, draw_series, is_smooth, moving_blocks, series_of
from tests.view.made_up import HOSTILE, boxes_of, overlapping
from tests.view.sweeps.made_up import made_up

GRAVITY = Input("gravity", "m/s^2", np.array([9.81, 1.0, 5.0, 9.81, 1.0, 5.0]))
RESTITUTION = Input("contact.restitution", "", np.repeat([0.1, 0.5], 3))
NAMES = ("W" * 200, *HOSTILE)


def test_one_key_gives_one_series_in_the_order_of_its_values() -> None:
    (series,) = series_of(made_up((Input("gravity", "", np.array([3.0, 1.0, 2.0])),)))
    assert series.values.tolist() == [1.0, 2.0, 3.0]
    assert series.x_mm[:, 1].tolist() == [60.0, 75.0, 90.0]
    assert series.label == ""


def test_second_key_gives_a_series_for_each_of_its_values() -> None:
    found = list(series_of(made_up((GRAVITY, RESTITUTION))))
    assert [one.label for one in found] == ["contact.restitution = 0.1", "contact.restitution = 0.5"]
    assert all(one.values.tolist() == [1.0, 5.0, 9.81] for one in found)


def test_keys_that_go_together_are_one_series() -> None:
    (series,) = series_of(made_up((GRAVITY, RESTITUTION), "list"))
    assert len(series.values) == 6


def test_failed_cases_are_left_out() -> None:
    (series,) = series_of(made_up((Input("gravity", "", np.array([1.0, 2.0, 3.0])),), failed=1))
    assert series.values.tolist() == [2.0, 3.0]


def series_with(blocks: int, label: str = "", runs: int = 11) -> Series:
    """Return blocks of which the first stays and every further one goes farther with the value."""
    values = np.linspace(9.999e-3, 10.001e-3, runs)
    return Series(label, values, 70.0 + np.linspace(-1.0, 1.0, runs)[:, None] * np.arange(blocks))


def test_svg_names_what_it_shows(tmp_path: Path) -> None:
    path = tmp_path / "series.svg"
    series = [series_with(3, "contact.restitution = 0.3"), series_with(3, "contact.restitution = 0.5")]
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
        draw_series([series_with(2, runs=runs)], ("a", "b"), ("gravity", "m/s^2"), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_only_smooth_series_are_joined() -> None:
    assert is_smooth(np.array([70.0, 70.5, 71.0, 70.9]))
    assert is_smooth(np.array([70.0, 70.001, 70.0, 70.002]))
    assert not is_smooth(np.array([70.0, 73.0, 70.0, 73.0]))


def test_blocks_that_stay_are_left_out_and_many_are_cut() -> None:
    assert moving_blocks([series_with(3)]) == [1, 2]
    assert moving_blocks([series_with(60)]) == list(range(60 - MOST_ROWS, 60))
    assert moving_blocks([series_with(1)]) == [0]


def test_unknown_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="unsupported picture format"):
        draw_series([series_with(2)], ("a", "b"), ("gravity", ""), tmp_path / "series.bmp")


@pytest.mark.parametrize("columns", [1, 2, 4])
@pytest.mark.parametrize("name", NAMES)
def test_long_and_hostile_names_cover_nothing(caught: list[Figure], columns: int, name: str) -> None:
    series, names = [series_with(3, name) for _ in range(columns)], ("1", name, "3")
    key = f"blocks.{name}.width", "m"
    draw_series(series, names, key, "series.png", title=name, measured={"3": (1.0, 2.0)})
    assert overlapping(caught[0]) == []


def test_short_names_are_whole(caught: list[Figure]) -> None:
    draw_series(
        [series_with(3), series_with(3)], ("1", "2", "brick"), ("overlap", "m"), "series.png", title="a short title"
    )
    texts = {text for text, _ in boxes_of(caught[0])}
    assert "a short title" in texts
    assert any(text.startswith("block brick: 68.00 to 72.00 mm, 4.00 mm apart") for text in texts)
    assert not any("…" in text for text in texts)


def test_headings_of_narrow_columns_keep_their_values(caught: list[Figure]) -> None:
    series = [series_with(3, f"friction.block_block.kinetic = 0.{number}") for number in range(4)]
    draw_series(series, ("1", "2", "3"), ("gravity", ""), "series.png")
    texts = [text for text, _ in boxes_of(caught[0])]
    assert [sum(text.endswith(f" = 0.{number}") for text in texts) for number in range(4)] == [1, 1, 1, 1]
