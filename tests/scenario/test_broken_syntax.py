"""Files that are no TOML, and lines that are hard to show. Every message in full."""

from collections.abc import Callable

import pytest

WIDTH = 'width = "40 mm"'

CASES = {
    "no value": (
        None,
        "\n[time]\nend =\n",
        """
bad.toml:21: not valid TOML: invalid value
   21 | end =
      |      ^
""",
    ),
    "text without quotes": (
        WIDTH,
        "width = 40 mm",
        """
bad.toml:10: this cannot follow here; strings need quotes
   10 | width = 40 mm
      |            ^
""",
    ),
    "text without an end": (
        WIDTH,
        'width = "40 mm',
        """
bad.toml:10: a string in quotes must end on its line
   10 | width = "40 mm
      |               ^
""",
    ),
    "table without an end": (
        "[blocks.brick]",
        "[blocks.brick",
        """
bad.toml:9: not valid TOML: expected ']' at the end of a table declaration
    9 | [blocks.brick
      |              ^
""",
    ),
    "list without an end": (
        None,
        "\n[[bodies]]\nvelocity = [0, 0\n",
        """
bad.toml:21: not valid TOML: unclosed array
   21 | velocity = [0, 0
      |                 ^
""",
    ),
    "key twice": (
        WIDTH,
        'width = "40 mm"\nwidth = "41 mm"',
        """
bad.toml:11: this key or table is defined further up
   11 | width = "41 mm"
      | ^^^^^
""",
    ),
    "table twice": (
        None,
        "\n[materials.steel]\ndensity = 1\n",
        """
bad.toml:20: this key or table is defined further up
   20 | [materials.steel]
      |  ^^^^^^^^^^^^^^^
""",
    ),
    "key twice in an inline table": (
        None,
        "\n[friction]\nblock_block = { static = 1, static = 2 }\n",
        """
bad.toml:21: this key or table is defined further up
   21 | block_block = { static = 1, static = 2 }
      | ^^^^^^^^^^^
""",
    ),
    "line with a tab and a bell": (
        WIDTH,
        '\twidth = "\x07"',
        """
bad.toml:10: not valid TOML: illegal character '\\x07'
   10 |  width = "�"
      |           ^
""",
    ),
    "very long line": (
        WIDTH,
        "width = { " + ", ".join(f"k{i} = {i}" for i in range(60)) + " }",
        """
bad.toml:10: blocks.brick.width: a table is not a number; a length above 0 such as "32 mm" is needed
   10 | width = { k0 = 0, k1 = 1, k2 = 2, k3 = 3, k4 = 4, k5 = 5, k6 = 6, k7 = 7, k8 = 8, k9 = 9, k10 = 10, k11 = 11, …
      |         ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
}


@pytest.mark.parametrize(("old", "new", "message"), CASES.values(), ids=CASES)
def test_syntax(
    refusal_of_edit: Callable[[str | None, str], tuple[int, str]], old: str | None, new: str, message: str
) -> None:
    assert refusal_of_edit(old, new) == (65, message.strip("\n"))
