"""Broken scenarios: each is refused with a located message, which stands in golden/broken.txt.

A section of broken/*.txt is what is added to the valid scenario, or lines that it loses (-) and gets in place (+). In
broken/structures.txt it is what stands in place of the structure.
"""

from pathlib import Path

import pytest

from tests.golden import parsed
from tests.scenario.conftest import Edit, Refused

STACK = 'kind = "stack"\nblock = "brick"\ncount = 3\n'
WIDTH = 'width = "40 mm"'


def edits() -> dict[str, Edit]:
    """Return what is done to the valid scenario, by subject and name."""
    return {
        f"{file.stem}: {name}": read(text) if file.stem != "structures" else (STACK, f"{text}\n")
        for file in sorted(Path(__file__).parent.glob("broken/*.txt"))
        for name, text in parsed(file.read_text()).items()
    }


def read(text: str) -> Edit:
    """Return the edit that a section stands for."""
    if text[0] != "-":
        return text
    gone, here = ("".join(f"{line[1:]}\n" for line in text.split("\n") if line[0] == sign) for sign in "-+")
    return gone, here


EDITS = edits()


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_scenarios(refused: Refused, edit: Edit) -> None:
    refused(edit)


ODD = {
    "overlong text": f'width = "{"4" * 200} mm"',
    "line with a tab and a bell": '\twidth = "\x07"',
    "very long line": "width = { " + ", ".join(f"k{i} = {i}" for i in range(60)) + " }",
}


@pytest.mark.parametrize("line", ODD.values(), ids=ODD)
def test_long_and_unprintable_lines(refused: Refused, line: str) -> None:
    refused((WIDTH, line))


@pytest.mark.parametrize("model", ["particles", "kernel"])
@pytest.mark.parametrize("spacing", ["1e-300 m", "1 nm", "0.5 um"])
def test_particles_finer_than_a_side_can_have_are_refused(refused: Refused, model: str, spacing: str) -> None:
    refused(f'[contact]\nmodel = "{model}"\nparticle_spacing = "{spacing}"')  # they overflowed a field of 16 bits


COLUMNS = b"time_s,displacement_m\n"
TABLES = {
    "empty": b"",
    "unknown column": b"# n\ntime_s,displacement\n0,0\n",
    "no time": b"t,displacement_m\n0,0\n",
    "time twice": b"time_s,time_s\n0,0\n",
    "one sample": COLUMNS + b"0,0\n",
    "time stands still": COLUMNS + b"0,0\n# a note\n\n0,1\n",
    "negative time": COLUMNS + b"-1,0\n1,0\n",
    "word": COLUMNS + b"0,0\n1,a\n",
    "not a number": COLUMNS + b"0,0\n1,nan\n",
    "one cell": COLUMNS + b"0,0\n1\n2,0\n",
    "open quote": COLUMNS + b'0,"0\n1,0\n',
    "no text": b"\xff\xfe\x00",
}


@pytest.mark.parametrize("content", TABLES.values(), ids=TABLES)
def test_tables(tmp_path: Path, refused: Refused, content: bytes) -> None:
    (tmp_path / "m.csv").write_bytes(content)
    refused('[motion]\nkind = "table"\ntable = "m.csv"')
