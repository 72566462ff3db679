"""Pictures, animations and pages in memory, as notebooks show them."""

from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, ClassVar

from blocksim.errors import InvalidInputError
from blocksim.simulation import files
from blocksim.view import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRAME_HEIGHT = 760  # pixels, of a report within a notebook
PNG, GIF, HTML = ".png", ".gif", ".html"


def _image(content: bytes, kind: str, what: str) -> str:
    source = f"data:image/{kind};base64,{b64encode(content).decode()}"
    return f'<img src="{source}" alt="{escape(what)}" style="max-width:100%">'


@dataclass(frozen=True, repr=False)
class PictureDisplay:
    """A figure that is not written yet; `dots` are those an inch of a PNG."""

    figure: "Figure"
    dots: float | None = None

    def content(self, suffix: str = PNG) -> bytes:
        """Return the bytes of the file that `blocksim plot` writes, in the format of a suffix."""
        with style.in_style(self.dots):
            return style.figure_bytes(self.figure, suffix)

    def save(self, path: Path | str, *, overwrite: bool = False) -> Path:
        """Write PNG, SVG or PDF. Raises InvalidInputError, OutputExistsError, OutputError."""
        path = style.picture_path(path)
        files.refuse_foreign(path, overwrite=overwrite)
        files.write_bytes(path, self.content(path.suffix.lower()))
        return path

    def _repr_png_(self) -> bytes:
        return self.content()

    def _repr_html_(self) -> str:
        return _image(self.content(), "png", "picture")


@dataclass(frozen=True, repr=False)
class AnimationDisplay:
    """A run over time; `draw` writes it into a file, `last` is a picture of its end."""

    figure: ClassVar[None] = None
    draw: Callable[[Path], object]
    last: Callable[[], PictureDisplay]

    @cached_property
    def gif(self) -> bytes:
        """The GIF, drawn when first asked for."""
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"animation{GIF}"
            self.draw(path)
            return path.read_bytes()

    def save(self, path: Path | str, *, overwrite: bool = False) -> Path:
        """Write GIF or MP4. Raises InvalidInputError, OutputExistsError, OutputError, UnavailableError."""
        path = Path(path)
        files.refuse_foreign(path, overwrite=overwrite)
        if path.suffix.lower() == GIF:
            files.write_bytes(path, self.gif)
        else:
            self.draw(path)
        return path

    def _repr_png_(self) -> bytes:
        return self.last().content()

    def _repr_html_(self) -> str:
        return _image(self.gif, "gif", "animation")


@dataclass(frozen=True, repr=False)
class PageDisplay:
    """A page of a report, all in one text."""

    text: str
    figure: ClassVar[None] = None

    def save(self, path: Path | str, *, overwrite: bool = False) -> Path:
        """Write HTML. Raises InvalidInputError for another suffix, OutputExistsError, OutputError."""
        path = Path(path)
        if path.suffix.lower() != HTML:
            raise InvalidInputError(f"{path}: '{path.suffix}' unsupported format; use {HTML}")
        files.refuse_foreign(path, overwrite=overwrite)
        files.write_bytes(path, self.text.encode(errors="replace"))
        return path

    def _repr_png_(self) -> None:
        return None

    def _repr_html_(self) -> str:
        look = f"width:100%;height:{FRAME_HEIGHT}px;border:0"
        return f'<iframe srcdoc="{escape(self.text)}" style="{look}"></iframe>'
