"""Words in messages: lists that are cut short, and known words that a misspelt one may mean."""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice

MAX_COMPARED = 1000
"""Known words that a misspelt one is compared with; a file of a million mistakes must not take minutes."""
LEAST_SHARE = 0.6  # of letters that two similar words have in common
ROUND_OFF = 1e-9
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
    "size": ("width",),
    "size_x": ("width",),
    "size_y": ("height",),
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
    "speed": ("rate",),
    "duration": ("end",),
    "tmax": ("end",),
}
"""Symbols and words of papers and other programs with the keys that mean the same; a table takes the first it has."""


def list_names(names: Sequence[object], most: int) -> str:
    """Return names separated by commas; of more than `most` the first, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(str, names[:most])) + more


def nearest(word: str, known: Iterable[str], most: int) -> str | None:
    """Return the known word that is most alike, whatever its case; None where more than `most` letters differ."""
    by_letters = {other.lower(): other for other in islice(known, MAX_COMPARED)}
    share = 1.0 - most / max(1, len(word)) - ROUND_OFF
    close = difflib.get_close_matches(word.lower(), by_letters, n=1, cutoff=max(LEAST_SHARE, share))
    return by_letters[close[0]] if close else None


def similar_word(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that is most alike, or begins like the given one; of two letters both must be right."""
    known = tuple(islice(known, MAX_COMPARED))
    if len(word) < 3:  # letters that a word needs before a similar word is suggested
        return nearest(word, known, most=0)
    alike = (other for other in known if other.startswith(word) or word.startswith(other))
    return (
        nearest(word, known, most=max(1, len(word) // 3))
        or min(alike, key=lambda other: abs(len(other) - len(word)), default=None)
        or nearest(word, known, most=len(word))
    )


def meant_word(word: str, known: Iterable[str]) -> str | None:
    """Return the known word for a symbol or a word of other programs, or the one that is similar."""
    known = tuple(islice(known, MAX_COMPARED))
    usual = (key for key in USUAL.get(word.lower(), ()) if key in known)
    return next(usual, None) or similar_word(word, known)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Suggest the known word that may have been meant, or nothing."""
    similar = similar_word(word, known)
    return f"did you mean {similar!r}?" if similar else ""


def did_you_mean_or_list(word: str, known: Iterable[object], what: str = "known", most: int = 10) -> str:
    """Suggest the known word that may have been meant, or list the first known words after what they are."""
    names = [str(name) for name in known]
    first = ", ".join(names[:most]) + (", …" if len(names) > most else "")
    return did_you_mean(word, names) or (f"{what}: {first}" if names else "none is defined")
