"""Two runs never write into one folder."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from blocksim.errors import OutputExistsError
from blocksim.simulation import simulate_into
from blocksim.simulation.claim import claimed
from tests.simulation.sliding import MODELS, interrupted_at, sliding

if TYPE_CHECKING:
    from pathlib import Path

HOLD = """
import sys
from pathlib import Path
from blocksim.simulation.claim import claimed
with claimed(Path(sys.argv[1])):
    print("claimed", flush=True)
    sys.stdin.read()
"""


@pytest.mark.parametrize(("resume", "overwrite"), [(False, False), (True, False), (False, True)])
def test_no_run_writes_where_another_one_does(tmp_path: Path, resume: bool, overwrite: bool) -> None:
    scenario = sliding(MODELS["surface-linear"], end=0.002)
    interrupted_at(scenario, tmp_path, [50])
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with claimed(tmp_path), pytest.raises(OutputExistsError, match="a run is in progress here"):
        simulate_into(scenario, tmp_path, resume=resume, overwrite=overwrite)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert simulate_into(scenario, tmp_path, resume=True).summary.resumed_from == (50,)


def test_folder_is_free_again_when_whoever_had_it_was_killed(tmp_path: Path) -> None:
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdin=pipe, stdout=pipe) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"claimed\n"
        with pytest.raises(OutputExistsError), claimed(tmp_path):
            pass
        other.kill()
        other.wait()
        with claimed(tmp_path):
            pass
