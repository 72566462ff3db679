"""Colours and letters that can be read."""

import errno
from pathlib import Path

import pytest

from blocksim.errors import OutputError
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
