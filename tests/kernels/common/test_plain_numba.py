"""BLOCKSIM_PLAIN_NUMBA=1: kernels that numba compiles by itself give the same bits, in more time."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
RUN = """
import sys, blocksim
from blocksim.kernels.common import compiler
for name in ("three_blocks", "three_blocks_nonsmooth"):
    scenario = blocksim.load(f"scenarios/{name}.toml", {"contact.stiffness_scale": 0.001, "time.end": 0.2})
    print(blocksim.run(scenario).summary.final_state_sha256)
print(compiler.PLAIN)
"""


def answer(**environment: str) -> list[str]:
    """Return what a process prints."""
    command, more = [sys.executable, "-c", RUN], {**os.environ, **environment}
    return subprocess.run(command, cwd=ROOT, env=more, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.long
def test_plain_numba_gives_the_same_bits(tmp_path: Path) -> None:
    plain = answer(BLOCKSIM_PLAIN_NUMBA="1", BLOCKSIM_CACHE_DIR=str(tmp_path))
    usual = answer(BLOCKSIM_PLAIN_NUMBA="0")
    assert [*plain[:2], plain[2], usual[2]] == [*usual[:2], "True", "False"]
    assert any(tmp_path.rglob("*.nbi"))  # the next run finds them
