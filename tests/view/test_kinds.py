"""Kinds of pictures by name."""

import pytest

from blocksim.errors import InvalidInputError
from blocksim.view.kinds import KINDS, kind_named


def test_kinds_are_found_and_misspelt_ones_told() -> None:
    assert [kind_named(name) for name in KINDS] == list(KINDS.values())
    with pytest.raises(InvalidInputError, match="--kind histroy: unknown kind for a run, did you mean 'history'"):
        kind_named("histroy")
    with pytest.raises(InvalidInputError, match="choose strip, final, history"):
        kind_named("pie chart")
