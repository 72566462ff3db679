"""Reading KEY=VALUES, as --vary and other options of studies take it."""

from collections.abc import Sequence

from blocksim.errors import Problem, ScenarioError
from blocksim.options import Option
from blocksim.scenario.overrides import UnfitOverrideError, parse_value
from blocksim.study.plan import Values, Variations

ENDS = ("from", "to", "count")
LEAST_ENDS = 2
LOG = "log"
PLUS_MINUS = ("+-", "±")
FORMS = "KEY=a,b,c, KEY=from:to:count, KEY=from:to or KEY=mean+-sd (from:to also with :log at the end)"
RANGE = "KEY=from:to (also with :log at the end)"
SPREAD = "KEY=from:to, KEY=mean+-sd or KEY=a,b,c (from:to also with :log at the end)"


def variations_option(
    text: str, metavar: str, python: str, flag: str = "--vary", forms: str = FORMS, *, is_repeatable: bool = True
) -> Option:
    """Return an option that gives values to keys, KEY=VALUES, of which there may be several."""

    def read(texts: str | Sequence[str]) -> Variations:
        return read_variations([texts] if isinstance(texts, str) else texts, flag, forms)

    return Option(text, (flag,), metavar, python, read, is_repeatable=is_repeatable, complete="scenario_keys")


def read_variations(texts: Sequence[str], option: str = "--vary", forms: str = FORMS) -> Variations:
    """Return the values of each key in texts such as `key=a,b,c`, `key=from:to:count` or `key=mean+-sd`.

    Raises ScenarioError where a text is none of these `forms`, which are those that the option takes; wrong keys and
    values show when the document is built.
    """
    unread, repeated, parts = [], [], {}
    for text in texts:
        key, equals, values = (part.strip() for part in text.partition("="))
        if not (equals and key and values):
            unread.append(Problem(f"{option} {text}", f"write {forms}"))
        elif key in parts:
            repeated.append(Problem(f"{option} {key}", "given twice; list all its values once"))
        else:
            parts[key] = (text, values)
    if problems := [*unread, *repeated]:
        raise ScenarioError(list(dict.fromkeys(problems)))
    return Variations(
        tables={key: _values(values) for key, (_, values) in parts.items()},
        texts={key: text for key, (text, _) in parts.items()},
    )


def _values(text: str) -> Values:
    sign = next((sign for sign in PLUS_MINUS if sign in text), None)
    if sign is not None:
        mean, _, sd = text.partition(sign)
        return {"mean": _value(mean), "sd": _value(sd)}
    parts = [_value(part) for part in text.split(":")]
    if len(parts) > LEAST_ENDS and parts[-1] == LOG:
        return {**dict(zip(ENDS, parts[:-1], strict=False)), "scale": LOG} if len(parts) <= len(ENDS) + 1 else parts
    if LEAST_ENDS <= len(parts) <= len(ENDS):
        return dict(zip(ENDS, parts, strict=False))
    return [_value(part) for part in text.split(",")]


def _value(text: str) -> object:
    """Return a TOML value, or the bare text, which is checked where it is used."""
    text = text.strip()
    try:
        return parse_value(text) if text else text
    except UnfitOverrideError:
        return text
