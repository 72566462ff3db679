"""The same scenes by blocksim, pymunk and Box2D: `python -m tests.bench.peers --help`, or `make bench-peers`.

Box2D 2.3 is a package; version 3 takes part where the environment variable BOX2D_V3 holds the path of a library of it.
"""

import argparse
import json
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from blocksim.bench.harness import REPEATS, BenchmarkRun, Effort, machine_lines, report, this_machine
from blocksim.bench.registry import choose
from blocksim.errors import BlocksimError
from tests.bench.peers import box2d_v3
from tests.bench.peers.bricks import BRICKS
from tests.bench.peers.engine import Readings
from tests.bench.peers.heap import HEAP
from tests.bench.peers.three_blocks import PAPER, WITHOUT_RESTITUTION
from tests.bench.peers.work_precision import draw_work_precision

PEERS = (PAPER, WITHOUT_RESTITUTION, BRICKS, HEAP)
PACKAGES = {"pymunk": "pymunk", "Box2D": "box2d"}  # module: name of its package


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print the table, and write the numbers as JSON with the picture beside them."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench.peers", description=__doc__)
    parser.add_argument("names", nargs="*", help=", ".join(one.name for one in PEERS))
    parser.add_argument("--quick", action="store_true", help="run reduced cases")
    parser.add_argument("--repeats", type=int, default=REPEATS, help="samples of each number")
    parser.add_argument("--out", type=Path, help="write everything as JSON; the picture stands beside it as PNG")
    asked = parser.parse_args(arguments)
    for module, package in PACKAGES.items():
        try:
            import_module(module)
        except ImportError as error:
            parser.error(f"the package {package} is missing ({error}): pip install 'blocksim[bench]'")
    try:
        without = [box2d_v3.MISSING] if box2d_v3.library() is None else []
    except OSError as error:
        parser.error(str(error))
    try:
        wanted = choose(asked.names, PEERS)
    except BlocksimError as error:
        parser.error(str(error))
    outcomes = [one.run(Effort(asked.quick, max(1, asked.repeats))) for one in wanted]
    _print(outcomes)
    machine = this_machine()
    print(*without, *machine_lines(machine), sep="\n")  # noqa: T201 - the output of a script
    if asked.out is not None:
        asked.out.write_text(json.dumps(report(machine, outcomes), indent=2) + "\n", encoding="utf-8")
        found = [one.findings.panel for one in outcomes if isinstance(one.findings, Readings)]
        panels = [panel for panel in found if panel is not None]
        if panels:
            title = "Accuracy for computing time, each engine against itself"
            draw_work_precision(panels, asked.out.with_suffix(".png"), title=title)


def _print(outcomes: Sequence[BenchmarkRun]) -> None:
    for outcome in outcomes:
        rows = [
            f"  {one.quantity:<54} {one.unit:<6} {one.median:9.4g} {min(one.samples):9.4g} {max(one.samples):9.4g}"
            for one in outcome.findings.numbers
        ]
        print(f"\n{outcome.measurement.name}: {outcome.measurement.title}", *rows, *outcome.findings.notes, sep="\n")  # noqa: T201
        if outcome.shortened:
            print(f"shortened: {outcome.shortened}")  # noqa: T201 - as above


if __name__ == "__main__":
    main()
