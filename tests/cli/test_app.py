"""The command itself: help, mistyped words completed, the schema, and that it starts quickly."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from blocksim.cli.commands import COMMANDS, GROUPS, app
from tests.cli.conftest import SOFT, Command
from tests.golden import Golden

HEAVY = ("numba", "pandas", "h5py", "matplotlib", "numpy")
UNUSED_BY_A_RUN = ("pandas", "matplotlib", "multiprocessing.pool", "blocksim.study.sweep")


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help(blocksim: Command, golden: Golden, name: str) -> None:
    answer = blocksim(*name.split(), "--help")
    assert (answer.code, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= 80
    golden(answer.out)


def test_a_run_compared_with_an_experiment_does_without_pandas_and_matplotlib(tmp_path: Path) -> None:
    scenario = Path(__file__).parents[2] / "scenarios" / "three_blocks.toml"
    code = (
        "import sys; from typer.testing import CliRunner; from blocksim.cli.commands import app;"
        "ended = CliRunner().invoke(app, ['run', *sys.argv[1:]]);"
        f"print(ended.exit_code, [name for name in {UNUSED_BY_A_RUN!r} if name in sys.modules])"
    )
    arguments = (scenario, "--out", tmp_path / "run", *SOFT)
    found = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "0 []"


def test_help_does_not_wait_for_heavy_packages() -> None:
    code = (
        "import sys; from typer.testing import CliRunner; from blocksim.cli.commands import app;"
        "assert CliRunner().invoke(app, ['--help']).exit_code == 0;"
        f"print([name for name in {HEAVY!r} if name in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_every_command_is_in_one_group_of_the_list() -> None:
    assert sorted(name for names in GROUPS.values() for name in names) == sorted(COMMANDS)


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("new wa", ["wall"]),
        ("run scenarios/slide.toml --set contact.sti", ["contact.stiffness_scale="]),
        ("run scenarios/slide.toml --set bodies.0.vel", ["bodies.0.velocity="]),
        ("run no_such.toml --set contact.", []),
        ("sweep scenarios/slide.toml --vary contact.sti", ["contact.stiffness_scale="]),
        ("limit scenarios/slide.toml --vary contact.sti", ["contact.stiffness_scale="]),
        ("limit scenarios/slide.toml --over contact.sti", ["contact.stiffness_scale="]),
        ("calibrate scenarios/slide.toml --fit contact.sti", ["contact.stiffness_scale="]),
        ("calibrate scenarios/slide.toml --scatter contact.sti", ["contact.stiffness_scale="]),
        ("fragility scenarios/slide.toml --intensity contact.sti", ["contact.stiffness_scale="]),
        ("fragility scenarios/slide.toml --scatter contact.sti", ["contact.stiffness_scale="]),
        ("fragility scenarios/slide.toml --stripes contact.sti", ["contact.stiffness_scale="]),
        ("sensitivity scenarios/slide.toml --vary contact.sti", ["contact.stiffness_scale="]),
        ("plot run --kind m", ["motion", "map", "matrix"]),
        ("plot run --kind tor", ["tornado"]),
        ("plot run --colour s", ["speed"]),
        ("animate run --colour pl", ["plastic"]),
        ("verify V2", ["V2", "V20", "V21", "V22", "V23", "V24", "V25"]),
        ("verify --soil S1", ["S1", "S10", "S11", "S12"]),
        ("plo", ["plot"]),
    ],
)
def test_shell_completes_kinds_and_keys(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: str, offered: list[str]
) -> None:
    monkeypatch.chdir(Path(__file__).parents[2])
    monkeypatch.setenv("_BLOCKSIM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", f"blocksim {line}")
    monkeypatch.setenv("COMP_CWORD", str(line.count(" ") + 1))
    with pytest.raises(SystemExit):
        app(prog_name="blocksim")
    said = capsys.readouterr()
    assert (said.out.split(), said.err) == (offered, "")


def test_schema_is_json(blocksim: Command) -> None:
    answer = blocksim("schema")
    assert json.loads(answer.out)["properties"]["schema"]
    assert answer.err == ""
