"""Damage to texts and files, drawn at random: small enough that most of the file stays what it was."""

import copy
import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import tomli_w
from hypothesis import strategies as st

HOSTILE = (
    *("nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "5e-324", "-0", "-0.0", "0", "-1", "0.5", "1e400", "00", "+1"),
    *("2147483648", "9223372036854775807", "9223372036854775808", "1" + "0" * 30, "9" * 5000, "0x7fffffffffffffff"),
    *("true", "false", "[]", "{}", '""', "''", '"nan mm"', '"inf m"', '"1e308 m"', '"-1 mm"', '"0 mm"', '"1e-300 m"'),
    *('"1 parsec"', '"1 mm mm"', '"mm"', '"1e999 kg"', '"90 deg"', '"1e20 deg"', '"m**1000000000"', '"1 m^9999999"'),
    *('"9**9**9**9 m"', '"(1+1) mm"', '"10**10**10 mm"', '"__import__(1) m"', '"{0} mm"', '"%s%n"', '"1 mm\\u0000"'),
    *('"\\u202e\\u2066"', '"\\ud83d"', '"\\U0001F4A9"', '"<script>alert(1)</script>"', '"../../x"', '"/etc/passwd"'),
    *('"' + "x" * 10_000 + '"', "[" * 20 + "]" * 20, "[" * 5000 + "]" * 5000, "{a=" * 18 + "1" + "}" * 18),
    *("[1, 2]", "[nan, 1e308]", '["1 mm"]', "{ static = nan }", "{ from = 0, to = 1e308, count = 1000000 }"),
    *("{ from = 1, to = 0, count = 3 }", "1979-05-27T07:32:00Z", "07:32:00", '"""\n\n"""', '"CON"', '"."', '".."'),
)
TABLE_HOSTILE = (
    *("nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "-0", "0", "-1", "1e400", "9" * 400),
    *("", " ", '"', '""', '"""'),
    *("=1+1", "+1", "-", ".", "1,5", "1;5", "0x10", "1_000", "1e", "\u0663", "\u202e7", "<b>", "x" * 2000, "1\t2", "#"),
    *("x", "rotation", "mm", "deg", "rad", "parsec", "block", "value", "1.5", "1000001", "NaN", "NA", "None", "true"),
)
NUMBER = re.compile(rb"-?\d+(\.\d+)?(e-?\d+)?")
VALUE = re.compile(rb"=\s*(.+)$", re.MULTILINE)
CELL = re.compile(rb"[^,\n]+")
ENTRY = re.compile(rb":\s*([^,\n]+)")


def _pieces(pattern: re.Pattern[bytes], words: Sequence[str]) -> Callable[[st.DrawFn, bytes], bytes]:
    """Return a change that puts a hostile word where a piece of the text matches."""

    def replaced(draw: st.DrawFn, text: bytes) -> bytes:
        found = list(pattern.finditer(text))
        if not found:
            return text
        piece = found[draw(st.integers(0, len(found) - 1))]
        group = 1 if pattern.groups and pattern is not NUMBER else 0
        word = draw(st.sampled_from(words))
        return text[: piece.start(group)] + word.encode("utf-8", "replace") + text[piece.end(group) :]

    return replaced


def _place(draw: st.DrawFn, last: int) -> int:
    """Draw where to change something; more often where a large file says what it holds."""
    return draw(st.one_of(st.integers(0, last), st.integers(0, min(last, 4096))))


def _line_deleted(draw: st.DrawFn, text: bytes) -> bytes:
    lines = text.split(b"\n")
    del lines[draw(st.integers(0, len(lines) - 1))]
    return b"\n".join(lines)


def _line_repeated(draw: st.DrawFn, text: bytes) -> bytes:
    lines = text.split(b"\n")
    line = lines[draw(st.integers(0, len(lines) - 1))]
    lines.insert(draw(st.integers(0, len(lines))), line)
    return b"\n".join(lines)


def _bytes_changed(draw: st.DrawFn, text: bytes) -> bytes:
    changed = bytearray(text)
    for _ in range(draw(st.integers(1, 8)) if text else 0):
        changed[_place(draw, len(text) - 1)] ^= 1 << draw(st.integers(0, 7))
    return bytes(changed)


def _cut_off(draw: st.DrawFn, text: bytes) -> bytes:
    return text[: draw(st.integers(0, len(text)))]


def _inserted(draw: st.DrawFn, text: bytes) -> bytes:
    place = draw(st.integers(0, len(text)))
    what = draw(st.one_of(st.binary(min_size=1, max_size=12), st.text(max_size=12).map(_encoded)))
    return text[:place] + what + text[place:]


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", "replace")


def _zeroed(draw: st.DrawFn, text: bytes) -> bytes:
    place = _place(draw, len(text))
    size = min(draw(st.sampled_from((8, 64, 512, 4096))), len(text) - place)
    return text[:place] + bytes(size) + text[place + size :]


def _filled(draw: st.DrawFn, text: bytes) -> bytes:
    """Set eight bytes to one: sizes and addresses become enormous."""
    place = _place(draw, max(0, len(text) - 8))
    return text[:place] + draw(st.sampled_from((b"\xff", b"\x7f"))) * 8 + text[place + 8 :]


def _moved(draw: st.DrawFn, text: bytes) -> bytes:
    """Put a block over another one."""
    size = min(draw(st.sampled_from((8, 64, 512))), len(text))
    source, target = (_place(draw, len(text) - size) for _ in range(2))
    return text[:target] + text[source : source + size] + text[target + size :]


ANY = (_line_deleted, _line_repeated, _bytes_changed, _cut_off, _inserted)
SCENARIO = (*ANY, *(_pieces(VALUE, HOSTILE),) * 4, _pieces(NUMBER, HOSTILE))
TABLE = (*ANY, *(_pieces(CELL, TABLE_HOSTILE),) * 3)
JSON = (*ANY, *(_pieces(ENTRY, HOSTILE),) * 3)
BINARY = (_bytes_changed, _cut_off, _zeroed, _filled, _moved)


@st.composite
def damaged(draw: st.DrawFn, content: bytes, ways: Sequence[Callable[[st.DrawFn, bytes], bytes]]) -> bytes:
    """Draw one to three changes of a file."""
    for _ in range(draw(st.integers(1, 3))):
        content = draw(st.sampled_from(ways))(draw, content)
    return content


def removals(content: bytes) -> Iterator[bytes]:
    """Yield a scenario without each of its tables, keys and entries of lists of tables."""
    data = tomllib.loads(content.decode())
    for path in _paths(data):
        less = copy.deepcopy(data)
        table: Any = less
        for part in path[:-1]:
            table = table[part]
        del table[path[-1]]
        yield tomli_w.dumps(less).encode()


def _paths(entry: Any) -> Iterator[tuple[str | int, ...]]:
    parts = entry if isinstance(entry, dict) else [i for i, one in enumerate(entry) if isinstance(one, dict)]
    for part in parts:
        yield (part,)
        if isinstance(entry[part], dict | list):
            yield from ((part, *path) for path in _paths(entry[part]))
