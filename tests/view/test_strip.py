"""Strips of pictures: valid files, the same bytes twice, nothing cut, and clear refusals."""

import struct
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

from blocksim.analysis import load_table
from blocksim.errors import InvalidInputError, OutputError
from blocksim.scenario.motion import MotionPieces
from blocksim.simulation.contacts import Contacts
from blocksim.view import strip, style
from blocksim.view.layout import Paper
from blocksim.view.run_data import Support
from blocksim.view.strip import arrangement, draw_strip, measured_ranges, plan, widened
from blocksim.view.window import Extent
from tests.view.made_up import overlapping

Floats = NDArray[np.float64]


@dataclass
class MadeUpFrames:
    time: Floats
    x: Floats
    y: Floats
    angle: Floats
    size_x: Floats
    size_y: Floats
    names: tuple[str, ...]
    contacts: Contacts | None = None


@dataclass
class MadeUpTable:
    ranges: dict[str, tuple[float, float, float]]

    def statistics(self) -> pd.DataFrame:
        rows = [
            {"block": block, "quantity": "x", "mean": mean, "minimum": minimum, "maximum": maximum}
            for block, (minimum, mean, maximum) in self.ranges.items()
        ]
        return pd.DataFrame([*rows, {"block": "1", "quantity": "rotation", "mean": 0.0}])


def toppling(blocks: int, steps: int = 40) -> MadeUpFrames:
    """Return blocks in rows of ten that turn to the right, the later the further up."""
    time = np.linspace(0.0, 0.6, steps)
    row, column = np.divmod(np.arange(blocks), 10)
    share = (time[:, None] / 0.6) ** 2
    return MadeUpFrames(
        time=time,
        x=0.040 * column + 0.06 * share * (row + 1),
        y=0.025 + 0.05 * row * (1.0 - share),
        angle=-0.5 * np.pi * share * np.ones(blocks),
        size_x=np.full(blocks, 0.032),
        size_y=np.full(blocks, 0.050),
        names=tuple(str(number + 1) for number in range(blocks)),
    )


def png_size(path: Path) -> tuple[int, int]:
    """Return width and height from the header of a PNG file."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[-8:-4] == b"IEND"
    width, height = struct.unpack(">II", data[16:24])
    return int(width), int(height)


def svg_texts(path: Path) -> str:
    """Return the texts of an SVG file; matplotlib keeps them as comments beside the drawn letters."""
    return path.read_text(encoding="utf-8")


@pytest.mark.parametrize("blocks", [1, 3, 10, 60])
def test_png_is_valid_and_as_wide_as_promised(tmp_path: Path, blocks: int) -> None:
    path = tmp_path / "strip.png"
    draw_strip(toppling(blocks), path, title="collapse")
    width, height = png_size(path)
    assert width == 1500
    assert 300 < height < 2500


def test_svg_and_pdf_are_what_they_say(tmp_path: Path) -> None:
    frames = toppling(3)
    draw_strip(frames, tmp_path / "strip.svg")
    draw_strip(frames, tmp_path / "strip.PDF")
    assert ET.parse(tmp_path / "strip.svg").getroot().tag.endswith("svg")  # noqa: S314 - our own file
    assert (tmp_path / "strip.PDF").read_bytes().startswith(b"%PDF-")


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_the_same_run_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    table = MadeUpTable({"1": (10.0, 20.0, 30.0)})
    paths = [tmp_path / f"{name}.{suffix}" for name in ("first", "second")]
    for path in paths:
        draw_strip(toppling(3), path, title="twice", measured=table)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert b"Date" not in paths[0].read_bytes()


def test_a_user_s_own_matplotlib_settings_change_nothing(tmp_path: Path) -> None:
    import matplotlib as mpl  # noqa: PLC0415 - only here

    draw_strip(toppling(3), tmp_path / "plain.png")
    with mpl.rc_context({"axes.facecolor": "red", "font.size": 20.0, "savefig.bbox": "tight"}):
        draw_strip(toppling(3), tmp_path / "own.png")
        assert mpl.rcParams["font.size"] == 20.0
    assert (tmp_path / "plain.png").read_bytes() == (tmp_path / "own.png").read_bytes()


def test_panels_name_their_times_and_the_two_ends(tmp_path: Path) -> None:
    draw_strip(toppling(3), tmp_path / "strip.svg", title="my run")
    texts = svg_texts(tmp_path / "strip.svg")
    for text in ("0.000 s, release", "0.600 s, final", "x (mm)", "my run"):
        assert f"<!-- {text} -->" in texts
    assert texts.count(" s -->") == 6


def test_times_given_by_hand_choose_the_panels(tmp_path: Path) -> None:
    draw_strip(toppling(3, steps=61), tmp_path / "strip.svg", times=[0.1, 0.3])
    texts = svg_texts(tmp_path / "strip.svg")
    assert "<!-- 0.100 s -->" in texts
    assert "<!-- 0.300 s -->" in texts
    assert "release" not in texts


def test_measured_centres_are_drawn_in_the_final_panel_only(tmp_path: Path) -> None:
    table = MadeUpTable({"1": (10.0, 20.0, 30.0)})
    for name, times in (("all", None), ("end", [0.6]), ("start", [0.0])):
        draw_strip(toppling(2), tmp_path / f"{name}.svg", times=times, measured=table)
    legend = "measured mean and range"
    assert legend in svg_texts(tmp_path / "all.svg")
    assert legend in svg_texts(tmp_path / "end.svg")
    assert legend not in svg_texts(tmp_path / "start.svg")


def test_the_shipped_measurements_fit_the_strip(tmp_path: Path) -> None:
    table = load_table(Path(strip.__file__).parents[2] / "scenarios" / "experiments" / "three_blocks.csv")
    draw_strip(toppling(3), tmp_path / "strip.svg", measured=table)
    assert "measured mean and range" in svg_texts(tmp_path / "strip.svg")


def test_odd_names_are_drawn_as_they_are(tmp_path: Path) -> None:
    frames = toppling(3)
    frames.names = ("$\\frac$", "<b>", "a_b^c")
    draw_strip(frames, tmp_path / "strip.svg", title="100 % $x_1$")
    assert "<!-- 100 % $x_1$ -->" in svg_texts(tmp_path / "strip.svg")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("strip.bmp", "'.bmp' unsupported picture format; use .png, .svg, .pdf"),
        ("strip", "'' unsupported picture format"),
    ],
)
def test_an_unknown_format_is_refused(tmp_path: Path, name: str, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        draw_strip(toppling(1), tmp_path / name)


def test_a_folder_that_does_not_exist_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none" / "strip.png"
    with pytest.raises(OutputError, match="cannot be written: No such file or directory"):
        draw_strip(toppling(1), path)


@pytest.mark.parametrize(
    ("extent", "columns", "panels"),
    [(Extent(0, 160, 0, 150), 4, 8), (Extent(0, 500, 0, 100), 2, 8), (Extent(0, 900, 0, 50), 1, 6)],
)
def test_long_scenes_get_fewer_columns(extent: Extent, columns: int, panels: int) -> None:
    assert arrangement(extent) == (columns, panels)


@pytest.mark.parametrize("extent", [Extent(0, 160, -5, 150), Extent(0, 900, -2, 50), Extent(-200, 300, -5, 2000)])
def test_panels_share_one_scale_and_do_not_overlap(extent: Extent) -> None:
    layout = plan(extent, *arrangement(extent), measured_rows=2)
    assert layout.panel_width * 72 / extent.width == pytest.approx(layout.points_per_mm)
    boxes = [layout.place(index) for index in range(layout.rows * layout.columns)]
    for left, bottom, width, height in boxes:
        assert min(left, bottom) > 0.0
        assert max(left + width, bottom + height) < 1.0
    for index, (left, bottom, width, height) in enumerate(boxes):
        for other_left, other_bottom, *_ in boxes[index + 1 :]:
            assert other_left >= left + width or other_bottom + height <= bottom


def test_names_that_need_larger_panels_get_them_where_the_page_allows() -> None:
    low, square = Extent(0, 800, 0, 400), Extent(0, 400, 0, 400)
    assert arrangement(low, readable=0.3) == (2, 8)
    assert arrangement(low, readable=0.1) == (4, 8)  # readable as it is
    assert arrangement(low, readable=5.0) == (4, 8)  # not readable either way
    assert arrangement(square, readable=0.5) == (4, 8)


def test_tilted_panels_have_room_for_the_numbers_along_the_ground() -> None:
    level, tilted = (plan(Extent(0, 400, 0, 300, tilt=tilt), 4, 8, measured_rows=1) for tilt in (0.0, 0.3))
    below = [one.panel_height * 72 - (300 - one.extent.lowest) * one.points_per_mm for one in (level, tilted)]
    assert below[1] - below[0] > 12.0


MOVING = MotionPieces(np.array([0.0, 0.3, 1.0]), np.array([[0.0, 0.0, 0.1, 0.0], [0.009, 0.0, 0.0, 0.0]]), 0.0)
SUPPORTS = {
    "level": Support(),
    "step": Support(profile=((0.05, 0.0), (0.05, -0.05)), fixed=(True, False, False)),
    "moving": Support(motion=MOVING, direction=(np.cos(0.3), np.sin(0.3)), fixed=(True, False, False)),
    "tilted": Support(tilt=0.3),
    "steep": Support(tilt=-0.9, motion=MOVING),
}


@pytest.mark.parametrize("kind", SUPPORTS)
@pytest.mark.parametrize("blocks", [1, 3])
def test_no_text_overlaps_another_or_is_cut(kind: str, blocks: int, picture: list[Figure], tmp_path: Path) -> None:
    support = replace(SUPPORTS[kind], fixed=SUPPORTS[kind].fixed[:blocks])
    table = MadeUpTable({"1": (50.0, 55.0, 60.0), "2": (52.0, 90.0, 110.0)})
    draw_strip(toppling(blocks), tmp_path / "strip.png", title="a title", measured=table, support=support)
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts_of(picture[0])]
    assert len(boxes) > 10
    for (one, box), (other, other_box) in combinations(boxes, 2):
        is_apart = min(box.x1, other_box.x1) - max(box.x0, other_box.x0) <= 0.0
        is_apart = is_apart or min(box.y1, other_box.y1) - max(box.y0, other_box.y0) <= 0.0
        assert is_apart, (one, other)
    whole = picture[0].bbox
    for text, box in boxes:
        assert min(box.x0, box.y0, whole.width - box.x1, whole.height - box.y1) >= 0.0, text


def texts_of(figure: Figure) -> list[Text]:
    """Return the texts that can be seen."""
    texts = list(figure.texts)
    for axes in figure.axes:
        texts += [*axes.texts, axes._left_title]  # type: ignore[attr-defined]
        if axes.xaxis.get_visible():
            low, high = axes.get_xlim()
            ticks = axes.xaxis.get_major_ticks()
            texts += [axes.xaxis.label, *(tick.label1 for tick in ticks if low <= tick.get_loc() <= high)]
    return [text for text in texts if text.get_text()]


@pytest.fixture
def picture(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Give a list that will hold the drawn figures, which go no further."""
    figures: list[Figure] = []

    def keep(figure: Figure, _: Path) -> None:
        figure.draw_without_rendering()
        figures.append(figure)

    monkeypatch.setattr(style, "save_figure", keep)
    return figures


def test_captions_tell_how_far_the_support_has_moved(tmp_path: Path) -> None:
    path = tmp_path / "strip.svg"
    draw_strip(toppling(3, steps=61), path, times=[0.0, 0.1, 0.3], support=Support(motion=MOVING))
    texts = svg_texts(path)
    for text in ("support 0.00 mm", "support +1.00 mm", "support +9.00 mm"):
        assert f"<!-- {text} -->" in texts
    assert "The support moves along x; dashes and arrow" in texts


def test_riding_on_the_support_gets_no_panels_of_its_own(tmp_path: Path) -> None:
    support, frames = Support(motion=MOVING), toppling(1)
    frames.x, frames.angle = support.displacement(frames.time)[:, None], np.zeros_like(frames.angle)
    frames.y = np.full_like(frames.y, 0.025)
    draw_strip(frames, tmp_path / "strip.svg", support=support)
    assert svg_texts(tmp_path / "strip.svg").count("<!-- support ") == 2


def test_the_legend_names_what_is_drawn(tmp_path: Path) -> None:
    path = tmp_path / "strip.svg"
    draw_strip(toppling(3), path, support=Support(tilt=-0.2, fixed=(True, False, False)))
    texts = svg_texts(path)
    assert "Grey: fixed." in texts
    assert "The ground is tilted by −11.5°, gravity points down" in texts
    assert "support" not in texts


def test_overlapping_measured_ranges_get_rows_of_their_own() -> None:
    table = MadeUpTable(
        {"3": (100.0, 110.0, 120.0), "1": (0.0, 5.0, 10.0), "2": (8.0, 20.0, 30.0), "9": (0.0, 1.0, 2.0)}
    )
    ranges = measured_ranges(table, ("1", "2", "3"), width=150.0)
    assert {item.block: item.row for item in ranges} == {"1": 0, "2": 1, "3": 0}


def test_a_scene_is_widened_to_hold_what_was_measured_and_a_tower_s_caption() -> None:
    table = MadeUpTable({"1": (-50.0, 5.0, 400.0)})
    wide = widened(Extent(0.0, 100.0, 0.0, 100.0), measured_ranges(table, ("1",), width=100.0))
    assert wide.left < -50.0
    assert wide.right > 400.0
    tower = widened(Extent(0.0, 30.0, 0.0, 1000.0), [])
    assert tower.width == pytest.approx(strip.NARROWEST * 1000.0)


@pytest.mark.parametrize("size", [(4.0, 8.0), (10.0, 3.5), (3.2, 15.0)])
@pytest.mark.parametrize("count", [2, 11])
def test_a_page_has_the_size_that_was_asked_for_and_its_panels_lie_in_it(
    picture: list[Figure], tmp_path: Path, size: tuple[float, float], count: int
) -> None:
    draw_strip(toppling(3), tmp_path / "strip.png", count=count, support=SUPPORTS["moving"], paper=Paper(size))
    assert picture[0].get_size_inches().tolist() == list(size)
    assert len(picture[0].axes) == count
    assert overlapping(picture[0]) == []
    boxes = [axes.get_position() for axes in picture[0].axes]
    assert min(min(box.x0, box.y0, 1.0 - box.x1, 1.0 - box.y1) for box in boxes) > 0.0


def test_a_page_that_is_too_small_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match=r"--size 25.4x25.4 mm is too small for this picture: at least \d+ mm"):
        draw_strip(toppling(3), tmp_path / "strip.png", paper=Paper((1.0, 1.0)))


def test_importing_the_room_does_not_load_matplotlib() -> None:
    code = "import sys, blocksim.view; sys.exit('matplotlib' in sys.modules or 'pandas' in sys.modules)"
    root = Path(strip.__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", code], cwd=root, check=False).returncode == 0
