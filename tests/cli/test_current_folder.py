"""The folder in which a command is called may be a stranger's: no module in it is executed, no settings are obeyed."""

import json
import os
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from blocksim.cli.commands import COMMANDS
from tests.cli.conftest import CLUSTER, SCENARIOS, SOFT

ROOT = Path(__file__).parents[2]
NAMES = sorted({*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize", "yaml"})
HOSTILE = "open({path!r} + '/' + __name__, 'w').close()\nraise SystemExit(__name__ + ' of the current folder')\n"
START = """
import sys
from blocksim.cli.app import main

if __name__ == "__main__":
    main()
"""
ALL = """
import json, sys
from blocksim.cli.app import main

if __name__ == "__main__":
    for command in json.loads(sys.argv[1]):
        sys.argv[1:] = command
        try:
            main()
        except SystemExit as ended:
            print(" ".join(command), "->", ended.code or 0, flush=True)
"""
SHORT = ("slide.toml", *SOFT, "--set", "time.end=0.01", "-q")
FRICTION = "friction.block_ground=0.3,0.4"
PROCESSES = ("--executor", "processes", "--jobs", "1")
FEW = ("--trials", "1", "--samples", "1", "--fresh", "1")
COMMANDS_IN_TURN: tuple[tuple[str, ...], ...] = (
    ("new", "wall", "made"),
    ("schema",),
    ("check", *SHORT),
    ("run", *SHORT, "--out", "run", "--live"),
    ("converge", *SHORT, "--levels", "2", "--study", "step", "--jobs", "1"),
    ("sweep", *SHORT, "--vary", FRICTION, "--out", "swept", *PROCESSES),
    ("sweep", *SHORT, "--vary", FRICTION, "--out", "kept", "--keep-cases", "--jobs", "1"),
    (
        "limit",
        *SHORT,
        "--vary",
        "friction.block_ground=0.1:0.9",
        "--stands",
        "moved < 4.5 mm",
        "--to",
        "50%",
        *PROCESSES,
    ),
    ("capacity", "pushed.toml", "-q"),
    ("fragility", *SHORT, "--intensity", FRICTION, "--scatter", "gravity=9.8+-0.1", "--samples", "2", *PROCESSES),
    ("calibrate", *SHORT, "--fit", FRICTION.replace(",", ":"), "--experiment", "measured.csv", *FEW),
    ("sensitivity", *SHORT, "--vary", "gravity=9.7:9.9", "--samples", "2"),
    ("compare", "run", "--experiment", "measured.csv"),
    ("plot", "run"),
    ("animate", "run", "--fps", "1"),
    ("report", "run"),
    ("export", "run", "--format", "dxf"),
    ("verify", "V1", "--quick", "-q"),
    ("verify-run", "run"),
    ("bench", "start-up", "--quick", "--repeats", "1", "-q"),
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give a folder with a module of every name that Python or any package has, and with settings of libraries."""
    marks, folder = tmp_path / "marks", tmp_path / "strangers"
    marks.mkdir()
    folder.mkdir()
    for name in NAMES:
        (folder / f"{name}.py").write_text(HOSTILE.format(path=str(marks)))
    (folder / ".numba_config.yaml").write_text("threading_layer: strangers\n")
    (folder / "slide.toml").write_text((SCENARIOS / "slide.toml").read_text())
    (folder / "pushed.toml").write_text((Path(__file__).parent / "scenes" / "pushed.toml").read_text())
    (folder / "measured.csv").write_text("block,quantity,unit,replicate,value\nblock,x,mm,1,4\nblock,x,mm,2,5\n")
    return folder


def call(folder: Path, script: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Call a script of another folder there, as the installed command is one."""
    path = folder.parent / "bin" / "script.py"
    path.parent.mkdir(exist_ok=True)
    path.write_text(script)
    command = [sys.executable, str(path), *arguments]
    more = {"PYTHONSAFEPATH": "", **environment}
    return subprocess.run(command, cwd=folder, env=os.environ | more, capture_output=True, text=True, check=False)


def executed(folder: Path) -> list[str]:
    """Return which modules of the folder were executed."""
    return sorted(path.name for path in (folder.parent / "marks").iterdir())


def test_no_command_executes_a_module_of_the_current_folder(folder: Path) -> None:
    assert {words[0] for words in COMMANDS_IN_TURN} == set(COMMANDS)
    done = call(folder, ALL, json.dumps(COMMANDS_IN_TURN))
    assert executed(folder) == []
    ends = {line.split()[0]: line.rpartition(" ")[2] for line in done.stdout.splitlines() if " -> " in line}
    assert set(ends) == set(COMMANDS), done.stderr
    assert {name for name, code in ends.items() if code not in {"0", "1"}} == set(), done.stderr
    assert done.stderr.count("is not obeyed") == 1


def test_an_empty_entry_of_the_path_for_modules_gives_a_command_no_package(folder: Path) -> None:
    for name in set(NAMES) - set(packages_distributions()) | {"_distutils_hack"}:  # Python imports some at its start
        (folder / f"{name}.py").unlink()
    done = call(folder, START, *COMMANDS_IN_TURN[5], PYTHONPATH=f"{os.environ.get('PYTHONPATH', ROOT)}:")
    assert done.returncode == 0, done.stderr
    assert executed(folder) == []


@pytest.mark.long
def test_a_sweep_on_a_dask_cluster_executes_no_module_of_the_current_folder(folder: Path) -> None:
    pytest.importorskip("distributed")
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", CLUSTER]
    with subprocess.Popen(command, cwd=folder.parent, stdin=pipe, stdout=pipe, text=True) as cluster:
        assert cluster.stdout is not None
        address = cluster.stdout.readline().strip()
        done = call(folder, START, *COMMANDS_IN_TURN[5][:-4], "--scheduler", address)
        cluster.communicate()
    assert done.returncode == 0, done.stderr
    assert executed(folder) == []
    assert (folder / "swept" / "sweep.csv").read_text().count("finished") == 2


HELPER = "VALUES = [0.3, 0.4]\n"
STUDY = """
import helper  # of its own folder
import blocksim.kernels
from blocksim import load, sweep
from numba import config

def main():
    scenario = load("slide.toml", {"contact.stiffness_scale": 0.001, "time.end": 0.01})
    found = sweep(scenario, {"friction.block_ground": helper.VALUES}, executor="processes", jobs=1)
    print(*found.table["status"], config.THREADING_LAYER)

if __name__ == "__main__":
    main()
"""


def test_a_script_starts_processes_with_its_own_modules_and_none_of_the_current_folder(folder: Path) -> None:
    own = folder.parent / "bin"
    own.mkdir()
    (own / "helper.py").write_text(HELPER)
    done = call(folder, STUDY)
    assert done.stdout == "finished finished default\n", done.stderr
    assert executed(folder) == []


@pytest.mark.parametrize("command", [("-m", "study"), ("study.py",)])
def test_a_study_that_is_a_module_of_the_current_folder_starts_processes(
    tmp_path: Path, command: tuple[str, ...]
) -> None:
    (tmp_path / "helper.py").write_text(HELPER)
    (tmp_path / "slide.toml").write_text((SCENARIOS / "slide.toml").read_text())
    (tmp_path / "study.py").write_text(STUDY)
    done = subprocess.run([sys.executable, *command], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout == "finished finished default\n", done.stderr
