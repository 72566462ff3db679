"""Where things are printed: the answer on standard output, everything else on standard error."""

import json
import math
from collections.abc import Iterable, Sequence

from rich import box
from rich.console import Console
from rich.table import Table

NARROW = 80


def answer_console() -> Console:
    """Return the console for answers; 80 columns where there is no terminal."""
    console = Console(highlight=False, soft_wrap=False)
    return console if console.is_terminal else Console(highlight=False, width=NARROW)


def note(text: str) -> None:
    """Print a line about what is going on, to standard error."""
    Console(stderr=True, highlight=False, soft_wrap=True).print(text, markup=False)


def print_json(data: object) -> None:
    """Print JSON to standard output; numbers that are not finite become null."""
    print(json.dumps(_finite(data), indent=2, default=str))  # noqa: T201 - this is the answer


def _finite(data: object) -> object:
    if isinstance(data, float):
        return data if math.isfinite(data) else None
    if isinstance(data, dict):
        return {str(key): _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return data


def print_table(title: str | None, columns: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> None:
    """Print a table to standard output; the first `left` columns are text, the others numbers."""
    table = Table(
        title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), title_style="bold"
    )
    for number, column in enumerate(columns):
        table.add_column(column, justify="left" if number < left else "right", no_wrap=number >= left)
    for row in rows:
        table.add_row(*row)
    answer_console().print(table)


def number(value: float, digits: int = 2) -> str:
    """Return a number for people: fixed digits, no minus sign on zero, a dash where there is none."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text
