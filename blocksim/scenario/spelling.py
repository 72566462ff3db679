"""Words in messages: lists that are cut short, and known words that a misspelt one may mean."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice

MIN_BEGINNING = 3
"""Letters that a word needs before a similar word is suggested."""
MAX_COMPARED = 1000
"""Known words that a misspelt one is compared with; a file of a million mistakes must not take minutes."""
MAX_LISTED = 10
USUAL: Mapping[str, tuple[str, ...]] = {
    "vx": ("velocity",),
    "vy": ("velocity",),
    "v": ("velocity", "speed"),
    "omega": ("spin",),
    "angular_velocity": ("spin",),
    "rotation": ("angle", "tilt"),
    "theta": ("angle", "tilt"),
    "inclination": ("tilt", "angle"),
    "slope": ("tilt", "angle"),
    "e": ("young_modulus", "restitution"),
    "nu": ("poisson_ratio",),
    "rho": ("density",),
    "gamma": ("unit_weight",),
    "phi": ("friction_angle",),
    "c": ("cohesion",),
    "psi": ("dilation",),
    "mu": ("block_block", "friction", "static"),
    "w": ("width",),
    "h": ("height",),
    "l": ("length",),
    "nx": ("columns",),
    "ny": ("rows",),
    "n": ("count",),
    "number": ("count",),
    "kn": ("normal_stiffness",),
    "ks": ("shear_stiffness_ratio",),
    "f": ("frequency",),
    "a": ("amplitude",),
    "dt": ("step", "every"),
    "timestep": ("step",),
    "interval": ("every",),
    "duration": ("end",),
    "tmax": ("end",),
}
"""Symbols and words of papers and other programs with the keys that mean the same; a table takes the first it has."""


def listed(names: Sequence[object], most: int) -> str:
    """Return names separated by commas; of more than `most` the first, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(str, names[:most])) + more


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


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Suggest the known word that may have been meant, or nothing."""
    similar = similar_word(word, known)
    return f"did you mean {similar!r}?" if similar else ""


def did_you_mean_or_list(word: str, known: Iterable[object]) -> str:
    """Suggest the known word that may have been meant, or list the first known words."""
    names = [str(name) for name in known]
    listed = ", ".join(names[:MAX_LISTED]) + (", …" if len(names) > MAX_LISTED else "")
    return did_you_mean(word, names) or (f"known: {listed}" if names else "none is defined")


def meant_word(word: str, known: Iterable[str]) -> str | None:
    """Return the known word for a symbol or a word of other programs, or the one that is similar."""
    known = tuple(islice(known, MAX_COMPARED))
    usual = (key for key in USUAL.get(word.lower(), ()) if key in known)
    return next(usual, None) or similar_word(word, known)


def similar_word(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that has the fewest typing errors, begins like the given one, or shares most of it."""
    known = tuple(islice(known, MAX_COMPARED))
    if len(word) < MIN_BEGINNING:  # of so few letters one that is wrong is half of the word
        return nearest(word, known, most=0)
    similar = nearest(word, known, most=max(1, len(word) // 3))
    if similar is not None:
        return similar
    alike = [other for other in known if other.startswith(word) or word.startswith(other)]
    if alike:
        return min(alike, key=lambda other: abs(len(other) - len(word)))
    return next(iter(difflib.get_close_matches(word.lower(), known, n=1)), None)


def suggestion(found: str, allowed: Sequence[str]) -> str:
    """Return the word that was probably meant, or the allowed ones."""
    close = difflib.get_close_matches(found.lower(), allowed, n=1)
    return f"did you mean '{close[0]}'?" if close else "allowed: " + ", ".join(allowed)
