"""Completion in real shells: names of a scenario, which may be a stranger's, are words there and nothing else."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from blocksim.cli.command_line import completion_of

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
SCENARIO = """
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


@pytest.fixture
def shell_folder(tmp_path: Path) -> Path:
    """Give a folder with a command `blocksim`, its completion script, and room for the scenario."""
    (tmp_path / "blocksim").write_text(f"#!{sys.executable}\nfrom blocksim.cli.app import main\nmain()\n")
    (tmp_path / "blocksim").chmod(0o700)
    return tmp_path


def complete_in(shell: str, folder: Path, material: str) -> str:
    """Complete the words after --set in a shell, for a scenario with this material; return what is offered."""
    (folder / "x.toml").write_text(SCENARIO.format(material=f'"{material}"'))
    environment = {**os.environ, "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": os.getcwd()}  # noqa: PTH109
    environment["_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"] = "1"
    show = ["blocksim", "--show-completion", shell]
    script = subprocess.run(show, cwd=folder, env=environment, check=True, text=True, capture_output=True)
    (folder / "script").write_text(script.stdout)
    subprocess.run([shell, "-c", SHELLS[shell]], cwd=folder, env=environment, check=False, capture_output=True)
    return (folder / "offered").read_text() if (folder / "offered").exists() else ""


@pytest.mark.parametrize("shell", SHELLS)
def test_hostile_name_of_a_material_executes_nothing_in_a_shell(shell_folder: Path, shell: str) -> None:
    offered = complete_in(shell, shell_folder, HOSTILE)
    assert not (shell_folder / "pwned").exists()
    assert "touch" not in offered


@pytest.mark.parametrize("shell", SHELLS)
def test_usual_names_are_offered_in_a_shell(shell_folder: Path, shell: str) -> None:
    assert "materials.stone.density=" in complete_in(shell, shell_folder, "stone")


@pytest.mark.parametrize("name", ["$(x)", "`x`", "a b", "a;b", "a'b", 'a"b', "a\nb", "*", "~", "a=b", "!1", "é", ""])
def test_only_words_are_offered(name: str) -> None:
    assert completion_of(lambda: ["usual", name])(None, "") == ["usual"]
