"""What is compared when a stored run is repeated, beside its frames."""

from pathlib import Path

import h5py

from blocksim.simulation import simulate_into
from blocksim.study.verify import verify_run
from tests.simulation.test_probes import PROBES, PULSE, scene


def test_a_changed_sample_is_found_when_a_run_is_verified(tmp_path: Path) -> None:
    result = simulate_into(scene("nonsmooth", PROBES, 0.03, motion=PULSE), tmp_path / "run")
    assert result.folder is not None
    assert verify_run(result.folder).agrees
    with h5py.File(tmp_path / "run" / "run.h5", "r+") as file:
        file["probes/joint4/slip"][2] += 1e-18
    step = result.probes["joint4"].step[2]
    (found,) = verify_run(result.folder).entries
    assert (found.file, found.entry) == ("run.h5", f"probes/joint4/slip at step {step}")
