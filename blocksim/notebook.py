"""What results are in a notebook: they draw themselves by code far above them, which the package registers here.

It is light, as the package imports it.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, cast

if TYPE_CHECKING:
    from pathlib import Path


class Display(Protocol):
    """A picture, an animation or a page in memory, which a notebook shows where it is the last value of a cell."""

    @property
    def figure(self) -> Any:
        """The figure of matplotlib; None for animations and pages."""
        ...

    def save(self, path: "Path | str", *, overwrite: bool = False) -> "Path":
        """Write it in the format that the suffix names. Raises InvalidInputError, OutputExistsError, OutputError."""
        ...

    def _repr_png_(self) -> bytes | None: ...

    def _repr_html_(self) -> str: ...


_sources: list[Callable[[], Any]] = []


def draw_with(source: Callable[[], Any]) -> None:
    """Register what gives the functions of blocksim.study.displays; it is asked when a result is first drawn."""
    _sources[:] = [source]


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

    def report(self, experiment: "Path | str | None" = None) -> Display:
        """Return the page of `blocksim.report`. Raises InvalidInputError, also for what is damaged in a folder."""
        return self._made("page_of", experiment=experiment)

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return self._picture()

    def _made(self, function: str, **options: Any) -> Display:
        return cast("Display", getattr(_sources[0](), function)(self, **options))

    def _picture(self) -> str:
        """Return the picture as HTML, below what else is shown; empty where there is none."""
        return str(_sources[0]().html_of(self))
