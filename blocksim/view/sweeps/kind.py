"""Definition of a kind of picture of a sweep."""

from collections.abc import Callable
from dataclasses import dataclass

from blocksim.view.sweeps.found import FoundSweep


@dataclass(frozen=True)
class Kind:
    """A kind of picture: its meaning in a few words, the sweeps that it cannot show or suits best, and its drawing.

    `draw` raises InvalidInputError for an unknown picture format and OutputError when the file cannot be written.
    """

    meaning: str
    refusal: Callable[[FoundSweep], str]  # why it cannot show a sweep; empty where it can
    suits: Callable[[FoundSweep], bool]
    draw: Callable[..., None]  # (sweep, path, paper = OWN)
