"""Printing: the answer on standard output, everything else on standard error."""

import json
import math
import os
import re
import shutil
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import islice
from typing import TextIO

NARROW = 80
GAP = "  "
SHORTEST = 8
STEERING = re.compile(  # must not be printed: names, descriptions and reasons may come from files of others
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f"  # control characters of ASCII and Latin-1 but tab and newline
    r"\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff"  # marks that change the direction of the text that follows
    r"\ud800-\udfff]"  # halves of characters
)
LONG_TIMES = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"))  # s


def note(text: str) -> None:
    """Print a line to standard error; do nothing after its reader has gone."""
    try:
        print(STEERING.sub("\ufffd", text), file=sys.stderr, flush=True)  # noqa: T201 - this is the place for it
    except OSError:
        abandon(sys.stderr)


def abandon(stream: TextIO) -> None:
    """Keep Python from failing once more when it flushes a stream at its end."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def answer(text: str) -> None:
    """Print the answer to standard output."""
    print(STEERING.sub("\ufffd", text))  # noqa: T201 - this is the place for it


def print_json(data: object) -> None:
    """Print JSON to standard output; numbers that are not finite become null."""
    answer(json.dumps(_finite(data), indent=2, default=str))


def _finite(data: object) -> object:
    if isinstance(data, float):
        return data if math.isfinite(data) else None
    if isinstance(data, dict):
        return {str(key): _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return data


def width_of_screen() -> int:
    """Return the columns of the terminal (or of COLUMNS), 80 without one."""
    return shutil.get_terminal_size((NARROW, 24)).columns


def table_lines(columns: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> list[str]:
    """Return a table: heads, a rule, rows; the first `left` columns are text, the others numbers to the right.

    Where it is wider than the screen, texts are cut, never numbers or heads.
    """
    cells = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(columns, *cells, strict=True)]
    excess = sum(widths) + len(GAP) * (len(widths) - 1) - width_of_screen()
    for i in sorted(range(left), key=lambda i: -widths[i]):
        least = max(len(columns[i]), SHORTEST)
        cut = min(max(excess, 0), max(widths[i] - least, 0))
        widths[i] -= cut
        excess -= cut

    def line(row: Sequence[str]) -> str:
        cut = [text if len(text) <= width else f"{text[: width - 1]}…" for text, width in zip(row, widths, strict=True)]
        texts = (text.ljust(width) for text, width in zip(cut[:left], widths, strict=False))
        numbers = (text.rjust(width) for text, width in zip(cut[left:], widths[left:], strict=True))
        return GAP.join((*texts, *numbers)).rstrip()

    return [line(columns), GAP.join("─" * width for width in widths), *map(line, cells)]


def grouped_lines(
    columns: Sequence[str], groups: Iterable[tuple[str, Sequence[Sequence[str]]]], left: int = 1
) -> list[str]:
    """Return one table of the rows of all groups, with a line above those of each."""
    groups = list(groups)
    head, rule, *lines = table_lines(columns, [row for _, rows in groups for row in rows], left)
    left_over = iter(lines)
    return [head, rule, *(line for name, rows in groups for line in (name, *islice(left_over, len(rows))))]


def number(value: float, digits: int = 2) -> str:
    """Return a number for people: fixed digits, no minus sign on zero, a dash where there is none."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def duration(seconds: float) -> str:
    """Return a time in the largest unit of which it has two or more."""
    worth, unit = next((entry for entry in LONG_TIMES if seconds >= 2.0 * entry[0]), (1.0, "s"))
    return f"{seconds / worth:.1f} {unit}"
