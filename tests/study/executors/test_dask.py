"""Sweeps on a real Dask cluster of two worker processes; in a process of their own, which the cluster needs."""

import logging
import subprocess
import sys
from pathlib import Path

import pytest

from blocksim.scenario import Document
from blocksim.study.executors.dask import silence
from blocksim.study.sweep import sweep
from tests.study.conftest import SCENARIOS

COUNT = 400
SCRIPT = f"""
import os, sys
from distributed import LocalCluster
from blocksim.study.sweep import sweep
from blocksim.scenario import Document

if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        workers = [worker.process.pid for worker in cluster.workers.values()]

        def on_row(done, total, row):
            if done == 10 and "kill" in sys.argv:
                os.kill(workers[0], 9)

        document = Document.read("{SCENARIOS / "three_blocks_nonsmooth.toml"}").with_values({{"time.end": 0.1}})
        vary = {{"friction.block_ground": {{"from": 0.2, "to": 0.6, "count": {COUNT}}}}}
        sweep(document, vary, out=sys.argv[1], scheduler=cluster.scheduler_address, on_row=on_row)
"""


def test_dask_is_quiet_while_a_sweep_uses_it_and_not_longer(capsys: pytest.CaptureFixture[str]) -> None:
    logger = logging.getLogger("distributed.client")
    handler = logging.StreamHandler(sys.stderr)
    logger.addHandler(handler)
    try:
        with silence():
            logger.error("Traceback: connection refused")
        assert capsys.readouterr().err == ""
        logger.error("something else")
        assert capsys.readouterr().err == "something else\n"
    finally:
        logger.removeHandler(handler)


@pytest.mark.long
@pytest.mark.parametrize("kill", [(), ("kill",)])
def test_cluster_gives_the_same_table_also_when_a_worker_dies(tmp_path: Path, kill: tuple[str, ...]) -> None:
    document = Document.read(SCENARIOS / "three_blocks_nonsmooth.toml").with_values({"time.end": 0.1})
    sweep(document, {"friction.block_ground": {"from": 0.2, "to": 0.6, "count": COUNT}}, out=tmp_path / "here")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    ended = subprocess.run(
        [sys.executable, str(script), str(tmp_path / "cluster"), *kill], check=False, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "cluster" / "manifest.jsonl").read_text().count("\n") == COUNT
    assert (tmp_path / "cluster" / "sweep.csv").read_bytes() == (tmp_path / "here" / "sweep.csv").read_bytes()
