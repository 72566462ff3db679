"""blocksim sensitivity: tables, files and what it refuses."""

import csv
from pathlib import Path

import pytest

from tests.cli.conftest import SCENARIOS, SOFT, Command

SLIDE = ("sensitivity", "scenarios/slide.toml", *SOFT)
VARY = ("--vary", "friction.block_ground=0.3:0.4", "--vary", "bodies.0.velocity.0=0.5 m/s+-0.02 m/s")


@pytest.mark.parametrize(
    ("method", "heads", "runs"), [("morris", ["mu*", "±", "mu", "sigma"], 12), ("sobol", ["S1", "±", "ST", "±"], 16)]
)
def test_tables_tell_what_matters_most_first(blocksim: Command, method: str, heads: list[str], runs: int) -> None:
    Path("indices.csv").write_text("an older table")
    answer = blocksim(*SLIDE, *VARY, "--method", method, "--samples", 4, "--out", "indices.csv", "--overwrite")
    assert answer.code == 0
    lines = answer.out.splitlines()
    assert lines[0].startswith("x of block block: 3")
    assert lines[1].split() == ["key", *heads]
    assert max(map(len, lines)) <= 80
    assert f"{runs} runs; table: indices.csv" in answer.err
    assert "does not vary: most frequent outcome 0" in answer.err
    first = [abs(float(line.split()[1])) for line in lines[3:]]
    assert len(first) == 2
    assert first == sorted(first, reverse=True)
    with Path("indices.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["key"] for row in rows] == ["friction.block_ground", "bodies.0.velocity.0"]


def test_distributions_of_the_scenario_are_the_default(blocksim: Command, tmp_path: Path) -> None:
    text = (SCENARIOS / "slide.toml").read_text()
    (tmp_path / "mine.toml").write_text(
        f'{text}\n[sweep]\nmode = "lhs"\n"friction.block_ground" = {{ from = 0.3, to = 0.4 }}\n'
    )
    answer = blocksim("sensitivity", "mine.toml", *SOFT, "--samples", 4)
    assert answer.code == 0
    assert "friction.block_ground" in answer.out
