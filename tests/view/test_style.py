"""Colours and letters that can be read; colours of blocks are the same in every picture."""

import errno
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import OutputError
from blocksim.scenario import Model
from blocksim.view import paints, style
from blocksim.view.paints import PAINTS, by_speed, by_turn
from blocksim.view.style import (
    BLOCK_COLOURS,
    break_lines,
    cut_to,
    open_figure,
    save_figure,
    shorten,
    text_colour,
    width_of,
)
from blocksim.view.sweeps.outcome_map import CLASS_COLOURS
from tests.view.made_up import toppling


def luminance(colour: str) -> float:
    """Return the relative luminance of the web accessibility guidelines (WCAG 2)."""
    parts = [int(colour[start : start + 2], 16) / 255 for start in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


@pytest.mark.parametrize("fill", BLOCK_COLOURS)
def test_block_names_stand_out_from_their_blocks(fill: str) -> None:
    light, dark = sorted((luminance(fill), luminance(text_colour(fill))), reverse=True)
    assert (light + 0.05) / (dark + 0.05) > 3.0


def test_signs_that_are_no_letters_become_boxes_and_wide_ones_count_twice() -> None:
    assert shorten("a\nb\u202e", 12) == "a□b□"
    assert shorten("3\N{NO-BREAK SPACE}mm", 12) == "3\N{NO-BREAK SPACE}mm"
    assert shorten("\N{GRINNING FACE}" * 9, 12) == "\N{GRINNING FACE}" * 5 + "…"


@pytest.mark.parametrize("text", ["W" * 200, "i" * 2000, "\u202e" * 50, "\N{GRINNING FACE}" * 40, "Sturz", ""])
def test_texts_are_cut_to_what_they_take_on_paper(text: str) -> None:
    cut = cut_to(text, 100.0, 8.0)
    assert width_of(cut, 8.0) <= 100.0
    assert cut == text or (cut.endswith("…") and width_of(f"{cut[:-1]}{cut[0]}…", 8.0) > 90.0)


def test_full_disk_leaves_the_older_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "a.png").write_text("older")
    monkeypatch.setattr("os.fsync", fail)
    with (
        open_figure(1.0, 1.0) as figure,
        pytest.raises(OutputError, match=r"a\.png: cannot be written: No space"),
    ):
        save_figure(figure, tmp_path / "a.png")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.png": "older"}


def test_long_names_are_broken_where_they_read_best_and_no_letter_is_lost() -> None:
    text = "contact.stiffness_scale = 0.001"
    wide = width_of(text, 8.0) / 72.0
    assert break_lines(text, wide * 1.01) == [text]
    assert break_lines(text, 0.8 * wide) == ["contact.stiffness_scale =", "0.001"]
    assert break_lines(text, 0.35 * wide) == ["contact.", "stiffness_", "scale =", "0.001"]
    assert "10.25 mm" in break_lines("structures.0.overlap − 10.25 mm (µm)", 0.65)
    assert break_lines("x" * 100, 0.5)[0].endswith("…")
    assert break_lines("", 1.0) == [""]


@pytest.mark.parametrize(("letters", "text"), [(4, "mass"), (3, "ma…")])
def test_a_name_that_just_fits_is_not_cut(letters: int, text: str) -> None:
    assert shorten("mass", letters) == text


SCENARIOS = Path(paints.__file__).parents[2] / "scenarios"


def test_speeds_have_one_scale_for_the_whole_run() -> None:
    frames = toppling(2)
    frames.vx[:], frames.vy[:] = 0.0, 0.0
    frames.vx[:, 1] = np.linspace(0.0, 2.0, len(frames))
    found = by_speed(frames)
    assert found.fills(0)[0] == found.fills(len(frames) - 1)[0] == found.fills(0)[1]
    shades = [style.brightness(found.fills(frame)[1]) for frame in range(0, len(frames), 4)]
    assert shades == sorted(shades, reverse=True)
    assert found.scale is not None
    assert (found.scale.label, found.scale.low, found.scale.high) == ("speed (m/s)", 0.0, 2.0)
    many = toppling(20, steps=100)
    many.vx[50, 3] = 100.0  # one impact, beside which all else would look like rest
    scale = by_speed(many).scale
    assert scale is not None
    assert scale.high < 1.0
    assert scale.extend == "max"


def test_turns_to_either_side_differ_and_none_lies_between() -> None:
    frames = replace(toppling(3))
    frames.angle[:] = np.linspace(0.0, 1.0, len(frames))[:, None] * np.array([-1.0, 0.0, 1.0])
    left, none, right = (style.brightness(fill) for fill in by_turn(frames).fills(len(frames) - 1))
    assert none > max(left, right)
    assert len(set(by_turn(frames).fills(len(frames) - 1))) == 3


def test_classes_of_a_map_are_reported_apart_in_grey() -> None:
    shades = sorted(style.brightness(colour) for colour in CLASS_COLOURS)
    assert min(np.diff(shades)) > 0.12


@pytest.mark.parametrize("name", PAINTS)
def test_blocks_that_never_move_have_colours_too(name: str) -> None:
    frames = toppling(5)
    for field in (frames.vx, frames.vy, frames.angle):
        field[:] = 0.0
    fills = PAINTS[name](frames, Model(SCENARIOS / "shaking_table.toml")).fills(0)
    assert all(len(fill) == 7 for fill in fills)
