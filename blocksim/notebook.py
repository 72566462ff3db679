"""What results are in a notebook: they draw themselves by code far above them, which the package registers here.

It is light, as the package imports it.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, cast


class Display(Protocol):
    """A picture, an animation or a page in memory, which a notebook shows where it is the last value of a cell."""

    @property
    def figure(self) -> Any:
        """The figure of matplotlib; None for animations and pages."""
        ...

    def save(self, path: Path | str, *, overwrite: bool = False) -> Path:
        """Write it in the format that the suffix names. Raises InvalidInputError, OutputExistsError, OutputError."""
        ...

    def _repr_png_(self) -> bytes | None: ...

    def _repr_html_(self) -> str: ...


DISPLAYS: list[Callable[[], Any]] = []  # gives the functions of blocksim.study.displays when a result is first drawn


class Shown:
    """What a notebook shows of a result, and pictures, animations and pages of it in memory."""

    def plot(self, kind: str | None = None, **options: Any) -> Display:
        """Return a picture; kinds and options are those of `blocksim.plot`.

        Raises InvalidInputError for an unknown kind and where there is nothing to draw.
        """
        return self._made("picture_of", kind=kind, **options)

    def animate(self, **options: Any) -> Display:
        """Return an animation, of a run; options are those of `blocksim.animate`. Raises InvalidInputError."""
        return self._made("animation_of", **options)

    def report(self, experiment: Path | str | None = None) -> Display:
        """Return the page of `blocksim.report`. Raises InvalidInputError, also for what is damaged in a folder."""
        return self._made("page_of", experiment=experiment)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the picture, or nothing where there is none; results put more above it."""
        return str(DISPLAYS[0]().html_of(self))

    def _made(self, function: str, **options: Any) -> Display:
        return cast("Display", getattr(DISPLAYS[0](), function)(self, **options))
