"""Size of a picture as a person writes it, 180x120mm or 1600x900px, and the options of the page."""

import re
from dataclasses import KW_ONLY, dataclass
from typing import Annotated

from blocksim.options import Option
from blocksim.view.style import DOTS_PER_INCH, MILLIMETRES_PER_INCH, Paper

SIZE = re.compile(r"([0-9]+(?:\.[0-9]*)?)\s*[x×]\s*([0-9]+(?:\.[0-9]*)?)\s*(mm|cm|in|px)?")
INCHES = {"mm": 1.0 / MILLIMETRES_PER_INCH, "cm": 10.0 / MILLIMETRES_PER_INCH, "in": 1.0}
LEAST_SIDE, MOST_SIDE = 20.0 / 25.4 - 1e-9, 2000.0 / 25.4 + 1e-9  # inches
SPARE_PIXEL = 0.25  # so that no round-off removes a whole one
MOST_PIXELS = 1e8
MOST_SHOWN = 40  # letters of a value in a message


@dataclass(frozen=True)
class PageSize:
    """Width and height of a picture in a unit."""

    width: float
    height: float
    unit: str

    @classmethod
    def read(cls, text: str) -> "PageSize":
        """Read WxH with mm, cm, in or px. Raises ValueError, also for sides that no page has."""
        match = SIZE.fullmatch(text.strip())
        if match is None:
            raise ValueError(f"{text[:MOST_SHOWN]!r} is not a picture size; write it as in 180x120mm or 1600x900px")
        size = cls(float(match[1]), float(match[2]), match[3] or "mm")
        if not all(LEAST_SIDE <= side <= MOST_SIDE for side in size.inches(150.0)):
            raise ValueError("each side of a picture must be 20 to 2000 mm (about 120 to 12 000 px)")
        return size

    def inches(self, dots: float) -> tuple[float, float]:
        """Return width and height in inches; pixels are those of a PNG with so many dots per inch."""
        if self.unit == "px":
            return (self.width + SPARE_PIXEL) / dots, (self.height + SPARE_PIXEL) / dots
        return self.width * INCHES[self.unit], self.height * INCHES[self.unit]


@dataclass(frozen=True)
class PageOptions:
    """Size and resolution of a picture."""

    _: KW_ONLY
    size: Annotated[
        tuple[float, float] | PageSize | None,
        Option(
            "Size of the picture: 180x120mm, 7x5in or 1600x900px.",
            python="Width and height of the picture in mm.",
            metavar="WxH",
            read=PageSize.read,
        ),
    ] = None
    dpi: Annotated[
        float | None, Option("Dots per inch of a PNG (default: 150).", metavar="N", least=20.0, most=1200.0)
    ] = None

    def __post_init__(self) -> None:
        """Raise ValueError for more than MOST_PIXELS."""
        if isinstance(self.size, PageSize):
            dots = self.dpi or DOTS_PER_INCH
            width, height = self.size.inches(dots)
            if width * height * dots**2 > MOST_PIXELS:
                raise ValueError(f"--size and --dpi make more than {MOST_PIXELS / 1e6:.0f} million pixels")

    @property
    def paper(self) -> Paper:
        """The page that these ask for."""
        if isinstance(self.size, PageSize):
            return Paper(self.size.inches(self.dpi or DOTS_PER_INCH), self.dpi)
        size = self.size
        return Paper(size and (size[0] / MILLIMETRES_PER_INCH, size[1] / MILLIMETRES_PER_INCH), self.dpi)
