"""Commands in a process of their own: it may hang, crash or take all memory, and the tests can tell."""

import gc
import json
import os
import resource
import select
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

PATIENCE = 120.0  # s of wall time, after which a command counts as hanging; machines of tests are busy
MOST_SECONDS = 2.0  # of processor time
MOST_BYTES = 10**9
COLLECTED = 10  # commands between two collections of garbage
ADDRESSES = 8 << 30  # bytes of address space, so that nothing takes the machine's memory; libraries map some of it
KERNEL = Path("/proc/self")  # where Linux tells what a process has taken
FORGET = "5"  # what it takes for: from here on, count the most memory again
START = "from tests.fuzz.child import serve; serve()"


@dataclass(frozen=True)
class Left:
    """What a command left: exit code, answer, what it told beside, and what it took (s of processor time, bytes)."""

    code: int
    out: str
    err: str
    seconds: float
    memory: int
    traceback: str


class Child:
    """A process that runs one command after the other; a new one takes the place of one that was lost."""

    def __init__(self, root: Path) -> None:
        """Start nothing yet; `root` is the folder that has `tests`."""
        self.root = root
        self.process: subprocess.Popen[str] | None = None

    def call(self, folder: Path, *arguments: object, patience: float = PATIENCE) -> Left:
        """Run a command in a folder; fails the test where it hangs (s of wall time), or takes the process with it."""
        process = self.process or self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps({"folder": str(folder), "arguments": list(map(str, arguments))}) + "\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], patience)
        line = process.stdout.readline() if ready else ""
        if line:
            return Left(**json.loads(line))
        self.close()
        what = f"crashed ({process.returncode})" if ready else f"did not come back within {patience} s"
        raise AssertionError(f"blocksim {' '.join(map(str, arguments))} {what}")

    def _started(self) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        command = [sys.executable, "-c", START]
        few = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # each maps addresses: with 64 there are not enough
        self.process = subprocess.Popen(command, cwd=self.root, text=True, bufsize=1, stdin=pipe, stdout=pipe, env=few)
        return self.process

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self.close()


def serve() -> None:
    """Run the commands that come in, a line each, until there are no more."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for number, line in enumerate(sys.stdin):
        if number % COLLECTED == 0:  # commands leave that to the end of their process
            gc.collect()
        answers.write(json.dumps(_left(**json.loads(line))) + "\n")
        answers.flush()


def _left(folder: str, arguments: list[str]) -> dict[str, Any]:
    import traceback  # noqa: PLC0415 - all of these belong to the process that is started

    from typer.testing import CliRunner  # noqa: PLC0415

    from blocksim.cli.commands import app  # noqa: PLC0415

    os.chdir(folder)
    _forget_memory()
    began = time.process_time()
    result = CliRunner().invoke(app, arguments)
    seconds = time.process_time() - began
    error = result.exception
    is_trouble = error is not None and not isinstance(error, SystemExit)
    return {
        "code": result.exit_code,
        "out": result.stdout,
        "err": result.stderr,
        "seconds": seconds,
        "memory": _most_memory(),
        "traceback": "".join(traceback.format_exception(error)) if is_trouble else "",
    }


def _forget_memory() -> None:
    if KERNEL.is_dir():
        (KERNEL / "clear_refs").write_text(FORGET)


def _most_memory() -> int:
    """Return the most bytes that this process has held since they were forgotten.

    Not what getrusage tells, where there is a choice: that starts from what the parent held, a worker of the tests
    with all kernels, and knows no command apart from those before it.
    """
    if not KERNEL.is_dir():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    line = next(line for line in (KERNEL / "status").read_text().splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) * 1024
