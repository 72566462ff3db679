"""What is true of every picture: what it shows, nothing covered or cut, its page, its bytes, and clear refusals."""

import xml.etree.ElementTree as ET
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from blocksim.errors import InvalidInputError
from blocksim.view import style
from blocksim.view.style import OWN, Paper
from tests.golden import Golden
from tests.view.described import described
from tests.view.drawings import DRAWINGS
from tests.view.made_up import overlapping
from tests.view.study_drawings import STUDIES

ALL = DRAWINGS | STUDIES
KINDS = (
    "strip",
    "final",
    "history",
    "joints",
    "levels",
    "work",
    "tornado",
    "series",
    "lines",
    "map",
    "matrix",
    "histogram",
)
SIZES = {
    "strip": (4.0, 8.0),
    "final": (3.2, 4.6),
    "history": (6.0, 8.0),
    "joints": (8.0, 6.0),
    "levels": (3.5, 2.5),
    "levels of three studies": (8.0, 3.0),
    "work": (6.0, 2.6),
    "tornado": (5.0, 6.0),
    "lines": (7.0, 8.0),
    "map": (9.0, 9.0),
    "matrix": (9.0, 9.0),
    "histogram": (5.0, 8.0),
}


@pytest.mark.parametrize("name", ALL)
def test_picture_shows_what_it_should_and_no_text_is_covered_or_cut(
    caught: list[Figure], golden: Golden, name: str
) -> None:
    ALL[name](Path("picture.png"), OWN)
    (figure,) = caught
    if mpl.__version_info__ < (3, 11):
        pytest.skip("details are those of texts as matplotlib sets them from 3.11 on")
    assert overlapping(figure) == []
    golden(described(figure))


@pytest.mark.parametrize(("name", "suffix"), [("final", "pdf"), ("tornado", "png"), ("strip", "svg")])
def test_same_data_give_the_same_bytes_of_a_valid_file(tmp_path: Path, name: str, suffix: str) -> None:
    first, second = (tmp_path / f"{number}.{suffix.upper()}" for number in (1, 2))
    DRAWINGS[name](first, OWN)
    with mpl.rc_context({"axes.facecolor": "red", "font.size": 20.0, "savefig.bbox": "tight"}):
        DRAWINGS[name](second, OWN)
        assert mpl.rcParams["font.size"] == 20.0
    assert first.read_bytes() == second.read_bytes()
    if suffix == "svg":
        assert ET.parse(first).getroot().tag.endswith("svg")  # noqa: S314 - our own file
    else:
        assert first.read_bytes().startswith({"png": b"\x89PNG\r\n\x1a\n", "pdf": b"%PDF-"}[suffix])


@pytest.mark.parametrize(("name", "size"), SIZES.items())
def test_page_has_the_size_that_was_asked_for_and_everything_lies_on_it(
    caught: list[Figure], name: str, size: tuple[float, float]
) -> None:
    DRAWINGS[name](Path("picture.png"), Paper(size))
    (figure,) = caught
    assert figure.get_size_inches().tolist() == pytest.approx(list(size))
    assert overlapping(figure) == []
    boxes = [axes.get_position() for axes in figure.axes]
    assert min(min(box.x0, box.y0, 1.0 - box.x1, 1.0 - box.y1) for box in boxes) >= 0.0


@pytest.mark.parametrize("name", KINDS)
def test_page_that_is_too_small_is_refused_before_anything_is_drawn(caught: list[Figure], name: str) -> None:
    for size, side in (((0.5, 9.0), "wide"), ((6.0, 0.4), "high")):
        told = rf"--size .* mm is too small for this picture: at least \d+ mm {side}"
        with pytest.raises(InvalidInputError, match=told):
            DRAWINGS[name](Path("picture.png"), Paper(size))
    assert caught == []


@pytest.mark.parametrize("suffix", ["svg", "pdf"])
def test_odd_names_can_be_written(tmp_path: Path, suffix: str) -> None:
    DRAWINGS["final with odd names"](tmp_path / f"final.{suffix}", OWN)
    assert (tmp_path / f"final.{suffix}").stat().st_size > 1000


REFERENCES = Path(__file__).parent / "references"
DOTS_PER_INCH = 100
COLOURS = 64
LARGEST_RMS = 3.0  # of 255
FAR_OFF, MOST_FAR_OFF = 32, 0.01  # a pixel is far off from here on; share of pixels that may be
DRAWN = {
    "strip": "strip with forces",
    "final": "final",
    "history": "history of impacts",
    "map": "map",
    "tornado": "tornado",
}


def pixels(path: Path) -> NDArray[np.float64]:
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"), dtype=np.float64)


def shrink(path: Path) -> None:
    """Write a picture again with few colours, as references have."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


def differ(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return True if two pictures are not the same to the eye."""
    if one.shape != other.shape:
        return True
    off = np.abs(one - other)
    return bool(np.sqrt((off**2).mean()) > LARGEST_RMS or (off.max(axis=-1) > FAR_OFF).mean() > MOST_FAR_OFF)


@pytest.mark.skipif(mpl.__version_info__ < (3, 11), reason="drawn with texts as matplotlib sets them from 3.11 on")
@pytest.mark.parametrize("name", DRAWN)
def test_picture_looks_like_its_reference(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(style.SETTINGS, "savefig.dpi", DOTS_PER_INCH)
    new, reference = REFERENCES / f"{name}.new.png", REFERENCES / f"{name}.png"
    DRAWINGS[DRAWN[name]](new, OWN)
    drawn = pixels(new)
    shrink(new)
    assert reference.is_file(), f"no reference yet: look at {new}"
    assert not differ(drawn, pixels(reference)), f"looks different: {new}"
    new.unlink()
