"""Broken scenarios: each is refused with a located message, which stands in golden/broken.txt.

A section of broken/*.txt is what is added to a valid scenario, the first section or that of conftest.py, or lines that
it loses (-) and gets in place (+). In broken/structures.txt it is what stands in place of the structure. In
broken/files/NAME.txt the first is the scenario, the others what stands in the file NAME.
"""

from pathlib import Path

import pytest

from tests.golden import parsed
from tests.scenario.conftest import VALID, Edit, Refused

STACK = 'kind = "stack"\nblock = "brick"\ncount = 3\n'
WIDTH = 'width = "40 mm"'


def edits() -> dict[str, tuple[Edit, str]]:
    """Return what is done to which valid scenario, by subject and name."""
    found: dict[str, tuple[Edit, str]] = {}
    for file in sorted(Path(__file__).parent.glob("broken/*.txt")):
        sections = parsed(file.read_text())
        valid = sections.pop("scenario", VALID)
        for name, text in sections.items():
            found[f"{file.stem}: {name}"] = (STACK, f"{text}\n") if file.stem == "structures" else read(text), valid
    return found


def read(text: str) -> Edit:
    """Return the edit that a section stands for."""
    if text[0] != "-":
        return text
    gone, here = ("".join(f"{line[1:]}\n" for line in text.split("\n") if line[0] == sign) for sign in "-+")
    return gone, here


EDITS = edits()


@pytest.mark.parametrize(("edit", "valid"), EDITS.values(), ids=EDITS)
def test_scenarios(refused: Refused, edit: Edit, valid: str) -> None:
    refused(edit, valid)


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


def files() -> dict[str, tuple[Edit, str, bytes]]:
    """Return what is wrong in a file that a scenario names: the scenario, the file's name and content."""
    found: dict[str, tuple[Edit, str, bytes]] = {}
    for file in sorted(Path(__file__).parent.glob("broken/files/*.txt")):
        sections = parsed(file.read_text())
        scenario = read(sections.pop("scenario"))
        contents = {name: text.encode() for name, text in sections.items()} | {"bytes": b"\0\1\xff\xfe"}
        found |= {f"{file.stem}: {name}": (scenario, file.stem, content) for name, content in contents.items()}
    return found


FILES = files()


@pytest.mark.parametrize(("edit", "name", "content"), FILES.values(), ids=FILES)
def test_files(tmp_path: Path, refused: Refused, edit: Edit, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    refused(edit)
