"""What a person reads of a broken table: the place, the message, the line and the mark below it."""

from collections.abc import Sequence
from pathlib import Path

Mistake = tuple[int, str, str, str]
"""Number of the line, column (none: the whole line), message, and the text from which on it is marked.

The last occurrence counts. Of a text with a comma only the first cell is marked; an empty one by one sign.
"""


def rendered(text: str, mistakes: Sequence[Mistake]) -> str:
    """Return the whole message about table.csv, whose text this is."""
    shown = []
    for number, column, message, marked in mistakes:
        line = text.splitlines()[number - 1]
        start = line.rindex(marked)
        length = len(marked.partition(",")[0]) if column else len(line)
        shown += [
            f"table.csv:{number}: {column}: {message}" if column else f"table.csv:{number}: {message}",
            f"    {number} | {line}",
            f"      | {' ' * start}{'^' * max(1, length)}",
        ]
    return "\n".join(shown)


def written(folder: Path, text: str) -> Path:
    """Return the table as a file."""
    path = folder / "table.csv"
    path.write_bytes(text.encode())
    return path
