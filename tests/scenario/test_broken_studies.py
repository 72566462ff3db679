"""Experiments, sweeps and provenance. Every message in full."""

# ruff: noqa: E501 - messages and scenario lines stand as they are

from collections.abc import Callable

import pytest

CASES = {
    "missing experiment table": (
        None,
        '\n[experiment]\ntable = "experiments/none.csv"\n',
        """
bad.toml:21: experiment.table: "experiments/none.csv": no such file (paths are relative to the scenario file)
   21 | table = "experiments/none.csv"
      |         ^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "folder for an experiment table": (
        None,
        '\n[experiment]\ntable = "."\n',
        """
bad.toml:21: experiment.table: ".": is a folder, not a table (paths are relative to the scenario file)
   21 | table = "."
      |         ^^^
""",
    ),
    "number for an experiment table": (
        None,
        "\n[experiment]\ntable = 3\n",
        """
bad.toml:21: experiment.table: 3 is not the path of a table, such as "experiments/three_blocks.csv"
   21 | table = 3
      |         ^
""",
    ),
    "experiment without a table": (
        None,
        "\n[experiment]\n",
        """
bad.toml:20: experiment.table: this key is missing: CSV table of the experiment, relative to the scenario file
   20 | [experiment]
      |  ^^^^^^^^^^
""",
    ),
    "empty sweep": (
        None,
        '\n[sweep]\nmode = "grid"\n',
        """
bad.toml:20: sweep: nothing to vary; add a line such as "contact.stiffness_scale" = [0.1, 1.0]
   20 | [sweep]
      |  ^^^^^
""",
    ),
    "misspelt sweep mode": (
        None,
        '\n[sweep]\nmode = "sobel"\n"time.end" = [1, 2]\n',
        """
bad.toml:21: sweep.mode: "sobel" is unknown, did you mean "sobol"?
   21 | mode = "sobel"
      |        ^^^^^^^
""",
    ),
    "sweep key that does not exist": (
        None,
        '\n[sweep]\n"friction.block_blok.static" = [0.2, 0.3]\n',
        """
bad.toml:21: sweep."friction.block_blok.static": unknown key, did you mean 'block_block'?
   21 | "friction.block_blok.static" = [0.2, 0.3]
      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "sweep key in a block that does not exist": (
        None,
        '\n[sweep]\n"blocks.brik.width" = ["1 mm", "2 mm"]\n',
        """
bad.toml:21: sweep."blocks.brik.width": blocks has no "brik", did you mean 'brick'?
   21 | "blocks.brik.width" = ["1 mm", "2 mm"]
      | ^^^^^^^^^^^^^^^^^^^
""",
    ),
    "sweep key that is none": (
        None,
        '\n[sweep]\n"time..end" = [1, 2]\n',
        """
bad.toml:21: sweep."time..end": "time..end" is not a dotted key
   21 | "time..end" = [1, 2]
      | ^^^^^^^^^^^
""",
    ),
    "sweep of the name": (
        None,
        '\n[sweep]\nname = ["a", "b"]\n',
        """
bad.toml:21: sweep.name: name cannot be varied
   21 | name = ["a", "b"]
      | ^^^^
""",
    ),
    "sweep without values": (
        None,
        '\n[sweep]\n"time.end" = []\n',
        """
bad.toml:21: sweep."time.end": the list of values is empty
   21 | "time.end" = []
      |              ^^
""",
    ),
    "sweep of one value": (
        None,
        '\n[sweep]\n"time.end" = 2\n',
        """
bad.toml:21: sweep."time.end": 2 is not a variation; write a list or { from, to, count }, and the key in quotes
   21 | "time.end" = 2
      |              ^
""",
    ),
    "sweep key without quotes": (
        None,
        "\n[sweep]\ntime.end = [1, 2]\n",
        """
bad.toml:21: sweep.time: a table is not a variation; write a list or { from, to, count }, and the key in quotes
   21 | time.end = [1, 2]
      |            ^^^^^^
""",
    ),
    "wrong value in a sweep": (
        None,
        '\n[sweep]\n"time.end" = ["1 s", "2 m"]\n',
        """
bad.toml:21: sweep."time.end".1: "2 m" is a length; a time above 0 such as "2 s" is needed
   21 | "time.end" = ["1 s", "2 m"]
      |                      ^^^^^
""",
    ),
    "wrong end of a range": (
        None,
        '\n[sweep]\n"contact.stiffness_scale" = { from = 0, to = 1, count = 5 }\n',
        """
bad.toml:21: sweep."contact.stiffness_scale".from: 0 is too small; a plain number above 0 is needed
   21 | "contact.stiffness_scale" = { from = 0, to = 1, count = 5 }
      |                                      ^
""",
    ),
    "range with a count of one": (
        None,
        '\n[sweep]\n"time.end" = { from = 1, to = 2, count = 1 }\n',
        """
bad.toml:21: sweep."time.end": count 1 is not a whole number from 2 to 100000
   21 | "time.end" = { from = 1, to = 2, count = 1 }
      |              ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "range from a length to a time": (
        None,
        '\n[sweep]\n"time.end" = { from = "1 mm", to = "2 s", count = 3 }\n',
        """
bad.toml:21: sweep."time.end": from "1 mm" and to "2 s" are not of one kind
   21 | "time.end" = { from = "1 mm", to = "2 s", count = 3 }
      |              ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "range from a misspelt unit": (
        None,
        '\n[sweep]\n"structures.0.offset" = { from = "1 nn", to = "2 mm", count = 3 }\n',
        """
bad.toml:21: sweep."structures.0.offset": "1 nn": unknown unit 'nn', write it as in "32 mm"
   21 | "structures.0.offset" = { from = "1 nn", to = "2 mm", count = 3 }
      |                         ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "list sweep of unequal lengths": (
        None,
        '\n[sweep]\nmode = "list"\n"time.end" = [1, 2]\n"ground.tilt" = ["1 deg"]\n',
        """
bad.toml:21: sweep.mode: mode "list" takes one value of every key at a time, but the numbers of values differ: 2 for time.end, 1 for ground.tilt
   21 | mode = "list"
      |        ^^^^^^
""",
    ),
    "misspelt key of the sweep itself": (
        None,
        '\n[sweep]\nmode = "lhs"\nsmaples = 10\n"time.end" = { from = 1, to = 2 }\n',
        """
bad.toml:22: sweep.smaples: unknown key, did you mean 'samples'?
   22 | smaples = 10
      | ^^^^^^^
""",
    ),
    "sampled sweep with everything wrong": (
        None,
        """
[sweep]
mode = "normal"
samples = 0
"time.end" = { mean = 1, sd = 0 }
"ground.tilt" = { mean = "1 deg", sd = "1 mm" }
"contact.restitution" = { from = 0.1, to = 1.1 }
""",
        """
bad.toml:22: sweep.samples: 0 is not a whole number from 1 to 1000000
   22 | samples = 0
      |           ^
bad.toml:23: sweep."time.end".sd: the standard deviation 0 is not above 0
   23 | "time.end" = { mean = 1, sd = 0 }
      |                               ^
bad.toml:24: sweep."ground.tilt": mean "1 deg" and sd "1 mm" are not of one kind
   24 | "ground.tilt" = { mean = "1 deg", sd = "1 mm" }
      |                 ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
bad.toml:25: sweep."contact.restitution".to: 1.1 is too large; a plain number of at least 0 and at most 1 is needed
   25 | "contact.restitution" = { from = 0.1, to = 1.1 }
      |                                            ^^^
""",
    ),
    "table mode without a table": (
        None,
        '\n[sweep]\nmode = "table"\n',
        """
bad.toml:21: sweep.mode: mode "table" needs the path of a table, as in table = "samples.csv"
   21 | mode = "table"
      |        ^^^^^^^
""",
    ),
    "table and keys": (
        None,
        '\n[sweep]\nmode = "table"\ntable = "none.csv"\nseed = 3\n"time.end" = [1, 2]\n',
        """
bad.toml:22: sweep.table: "none.csv": no such file (paths are relative to the scenario file)
   22 | table = "none.csv"
      |         ^^^^^^^^^^
bad.toml:23: sweep.seed: mode "table" has no key seed, which belongs to "lhs", "sobol", "normal"
   23 | seed = 3
      | ^^^^
bad.toml:24: sweep."time.end": mode "table" takes keys and values from its table
   24 | "time.end" = [1, 2]
      | ^^^^^^^^^^
""",
    ),
    "provenance of nothing": (
        None,
        '\n[provenance]\n"friction.blok" = "measured"\n',
        """
bad.toml:21: provenance."friction.blok": "friction.blok" is not a key of this scenario
   21 | "friction.blok" = "measured"
      | ^^^^^^^^^^^^^^^
""",
    ),
    "provenance key without quotes": (
        None,
        '\n[provenance]\nfriction.block_block = "measured"\n',
        """
bad.toml:21: provenance.friction: a table is not a string in quotes; quote the whole dotted key
   21 | friction.block_block = "measured"
      |                        ^^^^^^^^^^
""",
    ),
    "provenance that is no text": (
        None,
        '\n[provenance]\n"time.end" = 3\n',
        """
bad.toml:21: provenance."time.end": 3 is not a string in quotes
   21 | "time.end" = 3
      |              ^
""",
    ),
}


@pytest.mark.parametrize(("old", "new", "message"), CASES.values(), ids=CASES)
def test_studies(
    refusal_of_edit: Callable[[str | None, str], tuple[int, str]], old: str | None, new: str, message: str
) -> None:
    assert refusal_of_edit(old, new) == (65, message.strip("\n"))
