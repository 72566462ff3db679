"""Known words that a misspelt one may mean."""

from collections.abc import Iterable


def nearest(word: str, candidates: Iterable[str], most: int) -> str | None:
    """Return the candidate with the fewest typing errors, preferring equal length; None above `most` errors."""
    alike = (other for other in candidates if abs(len(word) - len(other)) <= most)
    scored = ((slips(word, other), abs(len(word) - len(other)), other) for other in alike)
    best = min(scored, key=lambda entry: entry[:2], default=None)
    return best[2] if best is not None and best[0] <= most else None


def slips(left: str, right: str) -> int:
    """Count the letters to replace, add, drop or swap between two words, whatever their case."""
    left, right = left.lower(), right.lower()
    before: list[int] = []
    row = list(range(len(right) + 1))
    for i, letter in enumerate(left, start=1):
        above, row = row, [i]
        for j, other in enumerate(right, start=1):
            cost = min(above[j] + 1, row[j - 1] + 1, above[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == right[j - 2] and left[i - 2] == other:
                cost = min(cost, before[j - 2] + 1)
            row.append(cost)
        before = above
    return row[-1]
