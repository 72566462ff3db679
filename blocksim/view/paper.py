"""The page of a picture: its default or the given size, and the dots per inch of a PNG."""

from dataclasses import dataclass

from blocksim.errors import InvalidInputError

MILLIMETRES_PER_INCH = 25.4


@dataclass(frozen=True)
class Paper:
    """Width and height of a picture (inches), None for the picture's own, and its dots per inch, None for 150.

    Letters and lines keep their size: a smaller page has smaller panels.
    """

    size: tuple[float, float] | None = None
    dots: float | None = None

    def width(self, own: float, least: float = 0.0) -> float:
        """Return the width (inches). Raises InvalidInputError where the page is narrower than `least`."""
        if self.size is None:
            return own
        if self.size[0] < least:
            raise InvalidInputError(self._refusal("wide", least))
        return self.size[0]

    def height(self, own: float) -> float:
        """Return the height (inches)."""
        return own if self.size is None else self.size[1]

    def panel(self, own: float, count: int, others: float, least: float) -> float:
        """Return the height (inches) of each of `count` panels in addition to `others` inches of text, axes and gaps.

        Raises InvalidInputError where panels would be lower than `least`.
        """
        if self.size is None:
            return own
        height = (self.size[1] - others) / count
        if height < least:
            raise InvalidInputError(self._refusal("high", others + count * least))
        return height

    def _refusal(self, side: str, least: float) -> str:
        width, height = (MILLIMETRES_PER_INCH * side for side in self.size or (0.0, 0.0))
        needed = MILLIMETRES_PER_INCH * least
        return f"--size {width:.4g}x{height:.4g} mm is too small for this picture: at least {needed:.0f} mm {side}"


OWN = Paper()
