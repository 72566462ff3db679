"""Figures caught before they are written."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from blocksim.view import style


@pytest.fixture
def caught(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Give a list that will hold the drawn figures, which go no further."""
    figures: list[Figure] = []

    def keep(figure: Figure, _: Path) -> None:
        with style.silence_missing_glyphs():
            figure.draw_without_rendering()
        figures.append(figure)

    monkeypatch.setattr(style, "save_figure", keep)
    return figures
