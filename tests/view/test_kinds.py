"""Kinds of pictures by name: which one a sweep gets, and that every kind draws every sweep that it does not refuse."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError
from blocksim.view.kinds import RUN_KINDS, SWEEP_KINDS, run_kind
from blocksim.view.sweeps.data import Input, SweepData
from tests.view.made_up import boxes_of, overlapping
from tests.view.made_up_sweeps import grid, made_up, samples

ONE = (Input("gravity", "m/s^2", np.linspace(1.0, 10.0, 8)),)
MEMBER = tuple(Input(one.key, one.unit, one.values[:1]) for one in samples()[:1])
SWEEPS = {
    "one key": (made_up(ONE), "lines"),
    "a word alone": (made_up(samples()[3:], "list"), "histogram"),
    "one key, drawn": (made_up(samples(1)[:1], "lhs"), "lines"),
    "grid": (made_up(grid()), "map"),
    "grid, some failed": (made_up(grid(), failed=5), "map"),
    "grid without measurements": (made_up(grid(), measured=False), "map"),
    "grid in columns": (made_up(grid(3)), "map"),
    "grid with too many columns": (made_up(grid(6)), "matrix"),
    "two keys, drawn": (made_up(samples(2)[:2], "sobol"), "map"),
    "drawn": (made_up(samples(4), "sobol", failed=3), "matrix"),
    "one member": (made_up(MEMBER, "sobol"), "lines"),
    "two keys of one member": (made_up(tuple(Input(str(i), "", np.ones(1)) for i in range(2)), "grid"), "lines"),
}
ODD = ("a word alone", "grid, some failed", "grid without measurements", "drawn", "one member")  # in all their kinds
DRAWN = [
    (name, kind)
    for name, (sweep, own) in SWEEPS.items()
    for kind in SWEEP_KINDS
    if (kind == own or name in ODD) and not SWEEP_KINDS[kind].refusal(sweep)
]


def test_kinds_are_found_and_misspelt_ones_told() -> None:
    assert [run_kind(name) for name in RUN_KINDS] == list(RUN_KINDS.values())
    with pytest.raises(InvalidInputError, match="--kind histroy: unknown kind for a run, did you mean 'history'"):
        run_kind("histroy")
    with pytest.raises(InvalidInputError, match="choose strip, final, history"):
        run_kind("pie chart")


@pytest.mark.parametrize(("sweep", "kind"), SWEEPS.values(), ids=SWEEPS)
def test_a_sweep_gets_the_picture_that_suits_it(sweep: SweepData, kind: str) -> None:
    assert next(name for name, picture in SWEEP_KINDS.items() if picture.suits(sweep)) == kind


@pytest.mark.parametrize(("name", "kind"), DRAWN)
def test_every_kind_draws_what_it_does_not_refuse(caught: list[Figure], name: str, kind: str) -> None:
    SWEEP_KINDS[kind].draw(SWEEPS[name][0], Path("picture.svg"))
    assert overlapping(caught[0]) == []
    assert "made up" in [text for text, _ in boxes_of(caught[0])]
