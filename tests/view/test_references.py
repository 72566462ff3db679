"""Pictures look as they did when somebody last looked at them.

They are drawn from made-up data with the matplotlib that is pinned. Where one differs, the new one is left beside the
reference; look at it, and rename it if it is better: NAME.new.png to NAME.png.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from blocksim.view import style
from blocksim.view.final import draw_final
from blocksim.view.history import draw_history
from blocksim.view.kinds import SWEEP_KINDS
from blocksim.view.run_data import Support
from blocksim.view.scene import PictureOptions
from blocksim.view.strip import draw_strip
from blocksim.view.studies import Bars, draw_tornado
from tests.view.made_up import pressed, toppling
from tests.view.sweeps.made_up import grid, made_up

REFERENCES = Path(__file__).parent / "references"
DOTS_PER_INCH = 100
COLOURS, MOST_BYTES = 64, 40_000
LARGEST_RMS = 3.0  # of 255
FAR_OFF, MOST_FAR_OFF = 32, 0.01  # a pixel is far off from here on; share of pixels that may be
FRAMES = pressed(toppling(3))


ROWS = [("x", "2", 98.0, 104.0, 110.0), ("x", "3", 139.0, 141.5, 145.0), ("rotation", "2", -90.0, -90.0, -90.0)]
NAMES = "quantity", "block", "minimum", "mean", "maximum"
REPEATS = [SimpleNamespace(**dict(zip(NAMES, row, strict=True))) for row in ROWS]  # in mm and degrees
MADE_UP = PictureOptions("made up", REPEATS)


def tornado(path: Path) -> None:
    keys = ("contact.restitution", "friction.block_block.static", "friction.block_ground.static")
    whole, alone = np.array([0.2, 0.7, 0.1]), np.array([0.1, 0.55, 0.05])
    one = Bars("x of block 2", keys, whole, np.array([0.1, 0.2, 0.02]), alone)
    other = Bars("x of block 3", keys, whole[::-1], np.array([0.05, 0.1, 0.2]), alone[::-1])
    draw_tornado([one, other], ("total", "alone"), path, "Which inputs matter")


PICTURES: dict[str, Callable[[Path], None]] = {
    "strip": lambda path: draw_strip(FRAMES, path, replace(MADE_UP, times=[0.0, 0.4, 0.6], forces=True)),
    "final": lambda path: draw_final(FRAMES, path, MADE_UP),
    "history": lambda path: draw_history(FRAMES, path, PictureOptions("made up", None, Support(weight=12.0))),
    "map": lambda path: SWEEP_KINDS["map"].draw(made_up(grid(3), failed=5), path),
    "tornado": tornado,
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


@pytest.mark.parametrize("name", PICTURES)
def test_picture_looks_like_its_reference(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(style.SETTINGS, "savefig.dpi", DOTS_PER_INCH)
    new, reference = REFERENCES / f"{name}.new.png", REFERENCES / f"{name}.png"
    PICTURES[name](new)
    drawn = pixels(new)
    shrink(new)
    assert reference.is_file(), f"no reference yet: look at {new}"
    assert not differ(drawn, pixels(reference)), f"looks different: {new}"
    new.unlink()


def test_a_line_that_is_gone_and_a_letter_that_has_moved_are_seen() -> None:
    reference = pixels(REFERENCES / "history.png")
    gone = reference.copy()
    blue = (np.abs(reference - [86, 180, 233]) < 40.0).all(axis=-1)
    gone[blue] = 255.0
    shifted = np.roll(reference, 2, axis=1)
    assert blue.sum() > 500
    assert differ(gone, reference)
    assert differ(shifted, reference)
    assert not differ(np.clip(reference + 2.0, 0.0, 255.0), reference)
