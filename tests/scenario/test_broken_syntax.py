"""Files that are no TOML, and lines that are hard to show."""

import pytest

from tests.scenario.conftest import Edit, Refused

WIDTH = 'width = "40 mm"'

CASES = {
    "no value": "[time]\nend =",
    "text without quotes": (WIDTH, "width = 40 mm"),
    "text without an end": (WIDTH, 'width = "40 mm'),
    "table without an end": ("[blocks.brick]", "[blocks.brick"),
    "list without an end": "[[bodies]]\nvelocity = [0, 0",
    "key twice": (WIDTH, 'width = "40 mm"\nwidth = "41 mm"'),
    "table twice": "[materials.steel]\ndensity = 1",
    "key twice in an inline table": "[friction]\nblock_block = { static = 1, static = 2 }",
    "line with a tab and a bell": (WIDTH, '\twidth = "\x07"'),
    "very long line": (WIDTH, "width = { " + ", ".join(f"k{i} = {i}" for i in range(60)) + " }"),
}


@pytest.mark.parametrize("edit", CASES.values(), ids=CASES)
def test_syntax(refused: Refused, edit: Edit) -> None:
    refused(edit)
