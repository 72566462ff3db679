"""Sessions at a shell: commands one after the other in one folder, and all that is printed, in golden/sessions.txt."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import Command
from tests.golden import RULES, Golden

HEAD = re.compile(r"^# (?P<name>[^(\n]*\w)(?: \((?P<rules>[\w ]+)\))?\n(?P<lines>(?:(?!# ).+\n)+)", re.MULTILINE)
SESSIONS = {
    f"{file.stem}: {found['name']}": (found["lines"].splitlines(), (found["rules"] or "").split())
    for file in sorted(Path(__file__).with_name("sessions").glob("*.txt"))
    for found in HEAD.finditer(file.read_text())
}
PIPE = re.compile(r"((?:[^'|]|'[^']*')*)(\|?)(.*)")  # a command, and what its answer is given to
SOMETIMES = (  # where a command takes long
    r"\d+ of \d+ \w+",
    r"\d+/\d+ cases, .*",
    r"(\d+)/(?!\1:)\d+: .*",
    r"[\d.]+ of at most .* steps, .*",
    "Compil(?:ing the solver|ed in) .*",
)
VARIES = (  # with the machine, or with the last bits of a long motion
    r"\d+(?= steps of)",
    r"(?<= s in )[\d.]+ s; relative energy error \S+",
    "(?<=moves at ).*(?= steps)",
    "(?<=has come ).*(?= mm without)",
    r"(?<!at most )\b\d+(?= frames\b)",
)
LINES = re.compile(f"^(?:{'|'.join(SOMETIMES)})\n", re.MULTILINE)
PIECES = re.compile("|".join(VARIES))
MARKED = [pytest.param(name, marks=pytest.mark.long if "long" in SESSIONS[name][1] else ()) for name in SESSIONS]


@pytest.fixture
def _place(finished: Path, made_up_run: Path, finished_sweep: Path, tmp_path: Path) -> None:
    """Give a folder with links to a finished run, one with made-up motion, a sweep, and pieces of scenarios."""
    folders = {"finished": finished, "made_up": made_up_run, "swept": finished_sweep}
    for name, folder in (folders | {"scenes": Path(__file__).with_name("scenes")}).items():
        (tmp_path / name).symlink_to(folder)


def in_shell(line: str, given: str = "") -> str:
    """Return what the shell prints at a line."""
    done = subprocess.run(
        ["bash", "-c", line],  # noqa: S607 - the one that users have
        env={**os.environ, "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])},
        input=given,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.stdout + f"exit code {done.returncode}\n" * bool(done.returncode)


@pytest.mark.usefixtures("_place")
@pytest.mark.parametrize("name", MARKED)
def test_sessions(blocksim: Command, golden: Golden, name: str) -> None:
    lines, rules = SESSIONS[name]
    told = []
    for line in lines:
        found = PIPE.fullmatch(line)
        assert found
        command, piped, after = found.groups()
        told.append(f"$ {line}\n")
        if not line.startswith("blocksim "):
            told.append(in_shell(line))
            continue
        answer = blocksim(*shlex.split(command)[1:])
        assert max(map(len, answer.out.splitlines()), default=0) <= 80 or piped or "wide" in rules
        told.append(in_shell(after, answer.out) if piped else answer.out)
        told.append(LINES.sub("", answer.err) + f"exit code {answer.code}\n" * bool(answer.code))
    golden(PIECES.sub("…", "".join(told)), rules=["sizes", "hashes", *(rule for rule in rules if rule in RULES)])
