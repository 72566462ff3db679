"""blocksim sweep: table, notes and exit codes."""

import csv
import json
from pathlib import Path

import pytest

from tests.cli.conftest import SCENARIOS, SOFT, Command

SHORT = ("sweep", "scenarios/three_blocks_nominal.toml", *SOFT, "--set", "time.end=0.01", "--jobs", 1, "--out", "out")
RIGID = ("sweep", "scenarios/three_blocks_nonsmooth.toml", "--set", "time.end=0.01", "--out", "out")
KINETIC = "friction.block_block.kinetic"


def rows() -> list[dict[str, str]]:
    with Path("out/sweep.csv").open() as file:
        return list(csv.DictReader(file))


def test_grid_from_the_command_line(blocksim: Command) -> None:
    answer = blocksim(*SHORT, "--vary", f"{KINETIC}=0.2:0.3:2", "--vary", "friction.block_ground.kinetic=0.2,0.3")
    assert answer.code == 0
    assert [(row[KINETIC], row["friction.block_ground.kinetic"]) for row in rows()] == [
        ("0.2", "0.2"),
        ("0.2", "0.3"),
        ("0.3", "0.2"),
        ("0.3", "0.3"),
    ]
    lines = answer.out.splitlines()
    assert "4 stands; largest displacement 0.20 mm, rotation 0.38°" in answer.err  # after a hundredth of a second
    assert {row["outcome"] for row in rows()} == {"stands"}
    assert "first to move" not in answer.err
    assert all(0.2 < float(row["turn_deg"]) < 0.39 for row in rows())
    assert lines[0].startswith("block_block.kinetic  block_ground.kinetic  inside   2.x_mm   3.x_mm")
    assert "not shown: 2 columns, 5 constant columns\n" in answer.err
    assert "0% of 4 cases are inside all measured ranges\n" in answer.err
    assert max(map(len, lines)) <= 80
    assert "4/4 finished: block_block.kinetic = 0.3, block_ground.kinetic = 0.3" in answer.err
    assert answer.err.splitlines()[-1] == "table: out/sweep.csv"


OWN = '[sweep]\n"friction.block_ground" = { from = 0.3, to = 0.4, count = 3 }\n'
TABLE = '[sweep]\nmode = "table"\ntable = "cases.csv"\n'
CASES = "structures.0.overlap [mm],time.scheme\n9,explicit\n10,nonsmooth\n"


@pytest.mark.parametrize(
    ("own", "options", "expected"),
    [
        (
            "",
            ("--vary", f"{KINETIC}=0.2,0.3", "--vary", "time.end=0.01,0.02", "--mode", "list"),
            {KINETIC: ["0.2", "0.3"], "time.end": ["0.01", "0.02"]},
        ),
        (OWN, (), {"friction.block_ground": ["0.3", "0.35", "0.4"]}),
        (TABLE, (), {"structures.0.overlap [mm]": ["9.0", "10.0"], "time.scheme": ["explicit", "nonsmooth"]}),
    ],
    ids=["list", "keys of the scenario", "table of the scenario"],
)
def test_cases_are_those_of_the_list_the_scenario_or_its_table(
    blocksim: Command, own: str, options: tuple[str, ...], expected: dict[str, list[str]]
) -> None:
    Path("cases.csv").write_text(CASES)
    nominal = (SCENARIOS / "three_blocks_nominal.toml").read_text().partition("[experiment]")[0]
    Path("mine.toml").write_text(f"{nominal}\n{own}")
    assert blocksim("sweep", "mine.toml", *SHORT[2:], *options).code == 0
    assert {key: [row[key] for row in rows()] for key in expected} == expected


def test_json_and_quiet_tell_nothing_else(blocksim: Command) -> None:
    vary = ("--vary", f"{KINETIC}=0.2,0.9")
    told = blocksim(*SHORT, *vary, "--json")
    data = json.loads(told.out)
    assert (told.code, told.err) == (77, "")
    assert [row["status"] for row in data["rows"]] == ["finished", "invalid"]
    assert data["rows"][1]["3.x_mm"] is None
    assert data["rows"][0]["inside"] is False
    quiet = blocksim(*SHORT, *vary, "--quiet")
    assert (quiet.code, quiet.err, len(quiet.out.splitlines())) == (77, "", 4)


def test_log_spacing_and_units_on_the_command_line(blocksim: Command) -> None:
    slide = ("sweep", "scenarios/slide.toml", *SOFT, "--set", "time.end=1e-3", "--out", "out")
    vary = ("--vary", "contact.stiffness_scale=1e-4:1e-2:3:log", "--vary", "ground.tilt=0 deg:2 deg:2")
    answer = blocksim(*slide, *vary)
    assert answer.code == 0
    head, _, *rows = (line.split() for line in answer.out.splitlines())
    assert head[:3] == ["contact.stiffness_scale", "ground.tilt", "[deg]"]
    assert [row[:2] for row in rows] == [[scale, tilt] for scale in ("0.0001", "0.001", "0.01") for tilt in ("0", "2")]
    assert "6/6 finished: contact.stiffness_scale = 0.01, ground.tilt = 2 deg" in answer.err


def test_many_rows_and_columns_are_cut_and_counted(blocksim: Command) -> None:
    answer = blocksim(
        "sweep", "scenarios/tower.toml", *SOFT, "--set", "time.end=1e-5", "--jobs", 1, "--out", "out",
        "--vary", "time.rest_speed=" + ",".join(f"{k}e-4" for k in range(1, 43)),
    )  # fmt: skip
    lines = answer.out.splitlines()
    assert len(lines) == 2 + 40
    assert max(map(len, lines)) <= 80
    assert "not shown: 2 rows, 16 constant columns\n" in answer.err


def test_largest_move_comes_before_the_places_of_many_blocks(blocksim: Command) -> None:
    answer = blocksim(
        "sweep", "scenarios/tower.toml", *SOFT, "--set", "time.end=0.05", "--jobs", 1, "--out", "out",
        "--vary", "ground.tilt=0 deg,-40 deg",
    )  # fmt: skip
    assert "outcome  displacement_mm     turn_deg   1.x_mm   2.x_mm" in answer.out.splitlines()[0]


def test_failures_are_listed_up_to_a_few(blocksim: Command) -> None:
    answer = blocksim(*SHORT, "--vary", "contact.max_overlap=1e-3," + ",".join(f"{k}e-9" for k in range(1, 9)))
    assert answer.code == 77
    assert answer.err.count("  failed: contact.max_overlap = ") == 5
    assert "8 of 9 cases did not finish; the first: an overlap exceeds contact.max_overlap" in answer.err
    assert "  and 3 more; --retry-failed runs them again" in answer.err


def test_shards_are_merged_and_missing_ones_named(blocksim: Command) -> None:
    vary = ("--vary", f"{KINETIC}=0.1:0.3:5")
    assert blocksim(*RIGID, *vary, "--shard", "0/2").code == 0
    early = blocksim("sweep", "--merge", "out")
    assert (early.code, early.out) == (65, "")
    assert "2 of 5 cases are missing" in early.err
    assert "--shard 1/2: 2 of 2 missing" in early.err
    merged = blocksim("sweep", "--merge", "out", "--allow-missing")
    assert merged.code == 0
    assert "2 cases have not been run; rerun the command to finish\n" in merged.err
    assert len(rows()) == 3
    assert blocksim(*RIGID, *vary, "--shard", "1/2").code == 0
    assert blocksim("sweep", "--merge", "out").code == 0
    assert len(rows()) == 5
