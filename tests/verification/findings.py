"""Run-outs of the three blocks that results/README.md quotes: measured, kept with their command and version.

`python -m tests.verification.findings results/README.md` rewrites the table from results/findings.json. With
`--measure` every run is repeated first: seconds for exact edges, some minutes for boundary particles. The tests repeat
the quick ones and compare them with the table.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blocksim import __version__
from blocksim.analysis.compare import Verdict
from blocksim.scenario import load_scenario
from blocksim.study.compare import compare_run
from blocksim.study.run import run
from tests.verification.paper import markdown
from tests.verification.reference import with_part

BEGIN = "<!-- findings: written by `make findings` -->"
END = "<!-- end of findings -->"
STORE = "findings.json"
SCENARIOS = Path("scenarios")
HEADS = ("run", "`blocksim run scenarios/…`", "block 1", "block 2", "block 3", "inside")
BLOCKS = ("1", "2", "3")


@dataclass(frozen=True)
class Finding:
    """One quoted run: a shipped scenario and the changed keys."""

    title: str
    scenario: str
    settings: tuple[str, ...] = ()
    slow: bool = False  # boundary particles: too long for `make test`

    @property
    def command(self) -> str:
        """Return what to type after `blocksim run scenarios/`."""
        return " ".join([f"{self.scenario}.toml", *(f"--set {setting}" for setting in self.settings)])


NOMINAL = "three_blocks_nominal"
RIGID = "three_blocks_nonsmooth"
PARTICLES = "three_blocks_particles"
FINDINGS = (
    Finding("printed constants, restitution 0.2 assumed", NOMINAL),
    Finding("the same, restitution 0", NOMINAL, ("contact.restitution=0",)),
    Finding("calibrated", "three_blocks"),
    Finding("calibrated, transition speed of friction 20 mm/s", "three_blocks", (
        "friction.block_block.transition_speed=0.02",
        "friction.block_ground.transition_speed=0.02",
    )),
    Finding("nominal with rigid contacts", RIGID),
    Finding("the same, restitution 0", RIGID, ("contact.restitution=0",)),
    Finding("32 × 25 mm in the plane", "three_blocks_literal"),
    Finding("nominal, Hertz–Mindlin", NOMINAL, ("contact.law=hertz-mindlin",)),
    Finding("nominal, SPH-smoothed particles 1 mm apart", NOMINAL, ("contact.model=kernel",), slow=True),
    Finding("Eqs 8–9 as printed, particles 0.5 mm apart", PARTICLES, ("contact.particle_spacing=0.0005",), slow=True),
    Finding("Eqs 8–9 as printed, particles 1 mm apart", PARTICLES, slow=True),
    Finding("Eqs 8–9 as printed, particles 2 mm apart", PARTICLES, ("contact.particle_spacing=0.002",), slow=True),
)  # fmt: skip


def measure_finding(finding: Finding) -> dict[str, Any]:
    """Run a finding; return its centres in mm, how far each lies beyond the measured range, and what is inside."""
    result = run(load_scenario(SCENARIOS / f"{finding.scenario}.toml", finding.settings))
    rows = {(row.block, row.quantity): row for row in compare_run(result).rows}
    inside = [f"block {block}" for block in BLOCKS if rows[block, "x"].verdict is Verdict.INSIDE]
    turned = all(rows[block, "rotation"].verdict is Verdict.INSIDE for block in BLOCKS)
    return {
        "command": finding.command,
        "version": __version__,
        "x_mm": [round(rows[block, "x"].simulated, 3) for block in BLOCKS],
        "beyond_mm": [round(rows[block, "x"].distance, 3) for block in BLOCKS],
        "long": [rows[block, "x"].error > 0.0 for block in BLOCKS],
        "inside": [*inside, "rotations"] if turned else inside,
    }


def with_table(text: str, stored: Sequence[dict[str, Any]]) -> str:
    """Return a page with the table of the kept findings between the two marks, in the order of FINDINGS."""
    by_command = {row["command"]: row for row in stored}
    rows = []
    for finding in (one for one in FINDINGS if one.command in by_command):
        row = by_command[finding.command]
        cells = [
            f"{x:.2f} ({beyond:.2f} {'too far' if far else 'short'})" if beyond else f"{x:.2f}"
            for x, beyond, far in zip(row["x_mm"], row["beyond_mm"], row["long"], strict=True)
        ]
        inside = "all" if len(row["inside"]) == len((*BLOCKS, "rotations")) else ", ".join(row["inside"])
        rows.append([finding.title, f"`{finding.command}`", *cells, inside])
    return with_part(text, BEGIN, markdown(HEADS, rows), END)


def main(arguments: Sequence[str]) -> None:
    """Write the table into the page named first, after measuring where asked to."""
    page, store = Path(arguments[0]), Path(arguments[0]).with_name(STORE)
    if "--measure" in arguments:
        rows = []
        for finding in FINDINGS:
            print(finding.command, file=sys.stderr, flush=True)  # noqa: T201 - progress
            rows.append(measure_finding(finding))
        store.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    text = page.read_text(encoding="utf-8")
    page.write_text(with_table(text, json.loads(store.read_text(encoding="utf-8"))), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
