"""Pictures look as they did when somebody last looked at them.

They are drawn from made-up data with the matplotlib that is pinned. Where one differs, the new one is left beside the
reference; look at it, and rename it if it is better: NAME.new.png to NAME.png.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from blocksim.view import style
from blocksim.view.style import OWN
from tests.view.drawings import DRAWINGS

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
