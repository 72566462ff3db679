"""What a run tells of where its bits come from."""

import json
import os
import platform
from pathlib import Path

import llvmlite.binding
import numba
import pytest

from blocksim.kernels.common.jit import source_hash
from blocksim.simulation import Result, provenance
from blocksim.simulation.results import read_summary
from tests.simulation.conftest import Shipped

NEW = ("llvmlite", "cpu", "cpu_features", "code_kernels", "code_scenario", "code_simulation", "code_world")


def test_rooms_are_reported_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    before = provenance.code_hashes()
    assert set(before) == set(provenance.ROOMS)
    assert len(set(before.values())) == len(before)

    def edited(folder: Path) -> str:
        return source_hash(folder) + ("edited" if folder.name == "world" else "")

    monkeypatch.setattr("blocksim.kernels.common.jit.source_hash", edited)
    after = provenance.code_hashes.__wrapped__()
    assert {room for room in after if after[room] != before[room]} == {"world"}


def test_run_tells_versions_processor_and_code(kept: Result) -> None:
    told = kept.summary.environment
    assert told["llvmlite"] == llvmlite.__version__
    assert told["numba"] == numba.__version__
    assert told["python"] == platform.python_version()
    assert told["cpu"] == llvmlite.binding.get_host_cpu_name()
    assert {f"code_{room}": digest for room, digest in provenance.code_hashes().items()}.items() <= told.items()


def test_features_are_those_that_the_processor_has() -> None:
    present = {name for name, is_there in llvmlite.binding.get_host_cpu_features().items() if is_there}
    features = set(provenance.environment()["cpu_features"].split())
    assert features
    assert features <= present


def test_summary_of_an_older_version_is_read(kept: Result, tmp_path: Path) -> None:
    data = json.loads(kept.summary.to_json())
    data["environment"] = {name: text for name, text in data["environment"].items() if name not in NEW}
    del data["threads"], data["sha256"]
    (tmp_path / "run.json").write_text(json.dumps(data))
    back = read_summary(tmp_path / "run.json")
    assert (back.threads, back.sha256) == (1, {})
    assert back.final_state_sha256 == kept.summary.final_state_sha256


def test_command_with_a_name_that_is_no_text_can_be_written(kept: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["blocksim", os.fsdecode(b"caf\xe9")])
    summary = kept.summary.model_copy(update={"environment": provenance.environment()})
    assert json.loads(summary.to_json())["environment"]["command"] == "blocksim 'caf\\udce9'"


def test_edited_code_gives_runs_another_name(soft: Shipped, monkeypatch: pytest.MonkeyPatch) -> None:
    before = provenance.run_hash(soft())
    monkeypatch.setattr(provenance, "code_hash", lambda: "of other code")
    assert provenance.run_hash(soft()) != before
