"""The command itself: help, words completed, also in real shells, the schema, checks, and that it starts quickly."""

import gc
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import pytest

from blocksim.cli.app import pause_collector
from blocksim.cli.command_line import completion_of
from blocksim.cli.commands import COMMANDS, GROUPS, app
from tests.cli.conftest import SCENARIOS, SOFT, Command
from tests.golden import Golden

HEAVY = ("numba", "pandas", "h5py", "matplotlib", "numpy")
UNUSED_BY_A_RUN = ("pandas", "matplotlib", "multiprocessing.pool", "rich", "blocksim.study.sweep")
MACHINE_CODE = "numba.np.arraymath"  # loaded with the first compiled kernel


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_help(blocksim: Command, golden: Golden, name: str) -> None:
    answer = blocksim(*name.split(), "--help")
    assert (answer.code, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= 80
    golden(answer.out)


def loaded(names: Sequence[str], *arguments: object) -> str:
    """Return the exit code of a command that a process of its own runs, and which of these modules it loaded."""
    code = (
        "import sys; from typer.testing import CliRunner; from blocksim.cli.commands import app;"
        "ended = CliRunner().invoke(app, sys.argv[1:]);"
        f"print(ended.exit_code, [name for name in {names!r} if name in sys.modules])"
    )
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def test_help_does_not_wait_for_heavy_packages_nor_a_compared_run_for_pandas_and_matplotlib(tmp_path: Path) -> None:
    assert loaded(HEAVY, "--help") == "0 []"
    run = ("run", SCENARIOS / "three_blocks.toml", "--out", tmp_path / "run", *SOFT)
    assert loaded(UNUSED_BY_A_RUN, *run) == "0 []"


def test_a_check_loads_no_machine_code_and_a_quiet_one_no_linear_programmes() -> None:
    check, unused = ("check", SCENARIOS / "three_blocks.toml"), (MACHINE_CODE, "scipy.optimize", "h5py", "rich")
    assert loaded(unused, *check) == "0 ['scipy.optimize']"
    assert loaded(unused, *check, "--quiet") == "0 []"


def test_a_plot_of_the_command_leaves_out_docstrings_and_one_from_python_does_not(tmp_path: Path) -> None:
    scenario, picture = SCENARIOS / "shaking_table.toml", tmp_path / "motion.png"
    calls = {
        f"blocksim.plot({str(scenario)!r}, kind='motion', out={str(picture)!r})": "True",
        f"blocksim.cli.commands.app(['plot', {str(scenario)!r}, '--kind', 'motion', '--out', {str(picture)!r}], "
        "standalone_mode=False)": "False",
    }
    for call, is_listed in calls.items():
        code = f"import blocksim.cli.commands; {call}; from matplotlib import lines; "
        code += "print('agg_filter' in lines.Line2D.set.__doc__)"
        assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == (
            f"{is_listed}\n"
        )


def test_every_command_is_in_one_group_of_the_list() -> None:
    assert sorted(name for names in GROUPS.values() for name in names) == sorted(COMMANDS)


WITH_KEYS = """run --set|sweep --vary|limit --vary|limit --over|calibrate --fit|calibrate --scatter|
    fragility --intensity|fragility --scatter|fragility --stripes|sensitivity --vary"""
WITH_KEY = [command.split() for command in WITH_KEYS.split("|")]
OFFERED = {
    **{f"{name} scenarios/slide.toml {key} contact.sti": "contact.stiffness_scale=" for name, key in WITH_KEY},
    "new wa": "wall",
    "run scenarios/slide.toml --set bodies.0.vel": "bodies.0.velocity=",
    "run no_such.toml --set contact.": "",
    "plot run --kind m": "motion map matrix",
    "plot run --kind tor": "tornado",
    "plot run --colour s": "speed",
    "animate run --colour pl": "plastic",
    "verify V2": "V2 V20 V21 V22 V23 V24 V25 V26",
    "verify --soil S1": "S1 S10 S11 S12",
    "plo": "plot",
}


@pytest.mark.parametrize(("line", "offered"), OFFERED.items())
def test_shell_completes_kinds_and_keys(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], line: str, offered: str
) -> None:
    monkeypatch.chdir(SCENARIOS.parent)
    monkeypatch.setenv("_BLOCKSIM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", f"blocksim {line}")
    monkeypatch.setenv("COMP_CWORD", str(line.count(" ") + 1))
    with pytest.raises(SystemExit):
        app(prog_name="blocksim")
    said = capsys.readouterr()
    assert (said.out.split(), said.err) == (offered.split(), "")


def test_schema_is_json(blocksim: Command) -> None:
    answer = blocksim("schema")
    assert json.loads(answer.out)["properties"]["schema"]
    assert answer.err == ""


def test_shipped_scenarios_are_valid(blocksim: Command, shipped: Path) -> None:
    answer = blocksim("check", shipped, "--quiet")
    assert (answer.code, answer.out, answer.err) == (0, "", "")


@pytest.mark.parametrize("is_on", [True, False])
def test_garbage_collector_is_kept_away_while_code_is_loaded_and_comes_back(*, is_on: bool) -> None:
    was_enabled = gc.isenabled()
    try:
        (gc.enable if is_on else gc.disable)()
        with suppress(ImportError), pause_collector():
            assert not gc.isenabled()
            raise ImportError
        assert gc.isenabled() == is_on
    finally:
        gc.unfreeze()
        (gc.enable if was_enabled else gc.disable)()


HOSTILE = "a$(touch pwned)`touch pwned`';touch pwned;'"
WORDS = "blocksim run x.toml --set "
BASH = f"""
source script
COMP_WORDS=({WORDS} "") COMP_CWORD=4
_blocksim_completion blocksim
printf '%s\\n' "${{COMPREPLY[@]}}" > offered
for word in "${{COMPREPLY[@]}}"; do eval "true $word"; done
"""  # what is chosen is run as it stands, at Enter
ZSH = f"""
compdef() {{}}
_arguments() {{ print -r -- "$@" > offered }}
source ./script
words=({WORDS} "") CURRENT=5
_blocksim_completion
"""
SHELLS = {name: text for name, text in (("bash", BASH), ("zsh", ZSH)) if shutil.which(name)}
STRANGE = """
schema = 1
name = "x"
bodies = [{{ block = "b", x = 0.0, y = 0.5 }}]
[materials.{material}]
density = 2700
young_modulus = 1e9
poisson_ratio = 0.3
[materials.usual]
density = 2700
young_modulus = 1e9
poisson_ratio = 0.3
[blocks.b]
width = 1.0
height = 1.0
length = 1.0
material = "usual"
"""


def complete_in(shell: str, folder: Path, material: str) -> str:
    """Complete the words after --set in a shell, for a scenario with this material; return what is offered."""
    (folder / "x.toml").write_text(STRANGE.format(material=f'"{material}"'))
    environment = {**os.environ, "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": os.getcwd()}  # noqa: PTH109
    environment["_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"] = "1"
    show = ["blocksim", "--show-completion", shell]
    script = subprocess.run(show, cwd=folder, env=environment, check=True, text=True, capture_output=True)
    (folder / "script").write_text(script.stdout)
    subprocess.run([shell, "-c", SHELLS[shell]], cwd=folder, env=environment, check=False, capture_output=True)
    return (folder / "offered").read_text() if (folder / "offered").exists() else ""


@pytest.mark.parametrize("shell", SHELLS)
def test_shells_offer_usual_names_and_execute_nothing_of_hostile_ones(tmp_path: Path, shell: str) -> None:
    command = tmp_path / "blocksim"
    command.write_text(f"#!{sys.executable}\nfrom blocksim.cli.app import main\nmain()\n")
    command.chmod(0o700)
    assert "materials.stone.density=" in complete_in(shell, tmp_path, "stone")
    offered = complete_in(shell, tmp_path, HOSTILE)
    assert not (tmp_path / "pwned").exists()
    assert "touch" not in offered


@pytest.mark.parametrize("name", ["$(x)", "`x`", "a b", "a;b", "a'b", 'a"b', "a\nb", "*", "~", "a=b", "!1", "é", ""])
def test_only_words_are_offered(name: str) -> None:
    assert completion_of(lambda: ["usual", name])(None, "") == ["usual"]
