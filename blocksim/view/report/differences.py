"""Labels for runs of one name in a report: the keys of their scenarios that differ."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from blocksim.scenario.keys import KeyPath, format_key
from blocksim.view.report.subjects import Subject

MOST_KEYS = 2  # in a label
UNTOLD = {"name", "description", "experiment", "provenance"}


def labels(subjects: Sequence[Subject]) -> dict[str, str]:
    """Return a label for each run that shares its name with another one, by the keys of the subjects."""
    counts = Counter(subject.name for subject in subjects if subject.page.get("values") is not None)
    return {
        subject.key: text
        for name in (name for name, count in counts.items() if count > 1)
        for subject, text in _labelled([one for one in subjects if one.name == name and one.page.get("values")])
    }


def _labelled(subjects: Sequence[Subject]) -> Iterator[tuple[Subject, str]]:
    flat = [dict(_leaves(subject.page["values"])) for subject in subjects]
    keys = [key for key in dict.fromkeys(key for values in flat for key in values) if _differs(flat, key)]
    kept = [key for key in keys if not _follows(key, keys, flat)]
    for subject, values in zip(subjects, flat, strict=True):
        parts = [f"{key} = {_shown(values.get(key))}" for key in kept[:MOST_KEYS]]
        more = len(kept) - MOST_KEYS
        yield subject, ", ".join([*parts, *([f"{more} more"] if more > 0 else [])])


def _differs(flat: Sequence[Mapping[str, object]], key: str) -> bool:
    return any(values.get(key) != flat[0].get(key) for values in flat)


def _follows(key: str, keys: Sequence[str], flat: Sequence[Mapping[str, object]]) -> bool:
    """Return True for a kinetic friction that equals the static one in all runs: one of the two suffices."""
    static = f"{key.removesuffix('.kinetic')}.static"
    return key.endswith(".kinetic") and static in keys and all(one.get(key) == one.get(static) for one in flat)


def _leaves(node: object, path: KeyPath = ()) -> Iterator[tuple[str, object]]:
    """Yield dotted keys and values below a node."""
    if isinstance(node, Mapping):
        for key, entry in node.items():
            if path or key not in UNTOLD:
                yield from _leaves(entry, (*path, str(key)))
    elif isinstance(node, list | tuple):
        for index, entry in enumerate(node):
            yield from _leaves(entry, (*path, index))
    else:
        yield format_key(path), node


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "–" if value is None else str(value)
