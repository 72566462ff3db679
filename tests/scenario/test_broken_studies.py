"""Experiments, sweeps and provenance."""

import pytest

from tests.scenario.conftest import Edit, Refused

CASES = {
    "missing experiment table": '[experiment]\ntable = "experiments/none.csv"',
    "folder for an experiment table": '[experiment]\ntable = "."',
    "number for an experiment table": "[experiment]\ntable = 3",
    "experiment without a table": "[experiment]",
    "empty sweep": '[sweep]\nmode = "grid"',
    "misspelt sweep mode": '[sweep]\nmode = "sobel"\n"time.end" = [1, 2]',
    "sweep key that does not exist": '[sweep]\n"friction.block_blok.static" = [0.2, 0.3]',
    "sweep key in a block that does not exist": '[sweep]\n"blocks.brik.width" = ["1 mm", "2 mm"]',
    "sweep key that is none": '[sweep]\n"time..end" = [1, 2]',
    "sweep of the name": '[sweep]\nname = ["a", "b"]',
    "sweep without values": '[sweep]\n"time.end" = []',
    "sweep of one value": '[sweep]\n"time.end" = 2',
    "sweep key without quotes": "[sweep]\ntime.end = [1, 2]",
    "wrong value in a sweep": '[sweep]\n"time.end" = ["1 s", "2 m"]',
    "wrong end of a range": '[sweep]\n"contact.stiffness_scale" = { from = 0, to = 1, count = 5 }',
    "range with a count of one": '[sweep]\n"time.end" = { from = 1, to = 2, count = 1 }',
    "range from a length to a time": '[sweep]\n"time.end" = { from = "1 mm", to = "2 s", count = 3 }',
    "range from a misspelt unit": '[sweep]\n"structures.0.offset" = { from = "1 nn", to = "2 mm", count = 3 }',
    "list sweep of unequal lengths": '[sweep]\nmode = "list"\n"time.end" = [1, 2]\n"ground.tilt" = ["1 deg"]',
    "misspelt key of the sweep itself": '[sweep]\nmode = "lhs"\nsmaples = 10\n"time.end" = { from = 1, to = 2 }',
    "sampled sweep with everything wrong": (
        '[sweep]\nmode = "normal"\nsamples = 0\n"time.end" = { mean = 1, sd = 0 }\n'
        '"ground.tilt" = { mean = "1 deg", sd = "1 mm" }\n"contact.restitution" = { from = 0.1, to = 1.1 }'
    ),
    "table mode without a table": '[sweep]\nmode = "table"',
    "table and keys": '[sweep]\nmode = "table"\ntable = "none.csv"\nseed = 3\n"time.end" = [1, 2]',
    "provenance of nothing": '[provenance]\n"friction.blok" = "measured"',
    "provenance key without quotes": '[provenance]\nfriction.block_block = "measured"',
    "provenance that is no text": '[provenance]\n"time.end" = 3',
}


@pytest.mark.parametrize("edit", CASES.values(), ids=CASES)
def test_studies(refused: Refused, edit: Edit) -> None:
    refused(edit)
