"""What check tells is what a run uses: memory from its arrays, what is free as Linux writes it, steps, frames, cost."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import ExitCode
from blocksim.kernels.common.arrays import World
from blocksim.scenario import Model, load_scenario
from blocksim.world import memory
from blocksim.world.build import build_world
from blocksim.world.describe import describe
from blocksim.world.free_memory import available_bytes, readable
from blocksim.world.memory import SceneTooLargeError, Size, refuse_if_too_large, scene_size

SCENARIOS = Path(__file__).parents[2] / "scenarios"
GIB = 1 << 30


def size_of(world: World, bodies: int) -> Size:
    pairs, slots = world.candidates.shape
    return scene_size(bodies, pairs, slots, has_particles=world.particles is not None)


@pytest.mark.parametrize("model", ["surface", "kernel", "particles"])
def test_the_estimate_is_that_of_the_arrays_of_a_world(model: str) -> None:
    scenario = load_scenario(SCENARIOS / "dominoes.toml", {"contact.model": model})
    world = build_world(Model(scenario))
    bodies = len(Model(scenario).bodies)
    arrays = sum(array.nbytes for array in world if isinstance(array, np.ndarray) and array is not world.particles)
    estimate = size_of(world, bodies).bytes - bodies * memory.OBJECT_BYTES
    assert arrays == pytest.approx(estimate, rel=0.1)


def test_a_scene_that_does_not_fit_is_refused_with_both_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_bytes", lambda: GIB)
    size = scene_size(bodies=10**6, pairs=8 * 10**6, slots=8)
    with pytest.raises(SceneTooLargeError) as caught:
        refuse_if_too_large(size)
    assert caught.value.exit_code == ExitCode.INVALID_INPUT
    assert (caught.value.needed, caught.value.available) == (size.bytes, GIB)
    message = str(caught.value)
    assert f"needs about {readable(size.bytes)} of memory, and 1.07 GB are free" in message
    assert "for 1000000 bodies and 8000000 pairs" in message


def test_bytes_are_readable() -> None:
    counts = (0, 999, 1000, 1234, 999_600, 3_149_000_000, 10**24)
    texts = ["0 bytes", "999 bytes", "1 kB", "1.23 kB", "1 MB", "3.15 GB", "1e+06 EB"]
    assert [readable(count) for count in counts] == texts


MEMINFO = {"proc/meminfo": f"MemTotal: {16 * GIB // 1024} kB\nMemAvailable: {8 * GIB // 1024} kB\nHugePages_Total: 0\n"}
GROUP_1 = {
    "proc/self/cgroup": "9:name=systemd:/\n4:memory:/batch/job\n",
    "sys/fs/cgroup/memory/batch/job/memory.limit_in_bytes": f"{4 * GIB}\n",
    "sys/fs/cgroup/memory/batch/job/memory.usage_in_bytes": f"{3 * GIB}\n",
    "sys/fs/cgroup/memory/batch/job/memory.stat": f"cache 1\ntotal_inactive_file {GIB}\n",
}
GROUP_2 = {
    "proc/self/cgroup": "0::/batch/job\n",
    "sys/fs/cgroup/batch/job/memory.max": f"{4 * GIB}\n",
    "sys/fs/cgroup/batch/job/memory.current": f"{3 * GIB}\n",
    "sys/fs/cgroup/batch/job/memory.stat": f"anon 1\ninactive_file {GIB}\n",
}


@pytest.mark.parametrize(
    ("files", "available"),
    [
        (MEMINFO | GROUP_1, 2 * GIB),
        (MEMINFO | GROUP_2, 2 * GIB),
        (GROUP_2, 2 * GIB),
        (MEMINFO | GROUP_2 | {"sys/fs/cgroup/batch/job/memory.max": "max\n"}, 8 * GIB),
        (  # the limit of a group around the own one
            MEMINFO
            | GROUP_2
            | {"sys/fs/cgroup/batch/memory.max": f"{5 * GIB}\n", "sys/fs/cgroup/batch/memory.current": f"{4 * GIB}\n"},
            GIB,
        ),
        (MEMINFO | GROUP_2 | {"sys/fs/cgroup/batch/job/memory.max": f"{GIB}\n"}, 0),  # lowered below what is in use
        (MEMINFO | GROUP_1 | {"sys/fs/cgroup/memory/batch/job/memory.limit_in_bytes": f"{2**63}\n"}, 8 * GIB),
        (MEMINFO | {"proc/self/cgroup": "0::/gone\n"}, 8 * GIB),
        (MEMINFO | GROUP_2 | {"sys/fs/cgroup/batch/job/memory.stat": ""}, GIB),
        ({}, None),  # a system that tells nothing
    ],
)
def test_available_memory_is_the_least_of_all_limits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: Mapping[str, str], available: int | None
) -> None:
    monkeypatch.setattr("os.sysconf_names", {})
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert available_bytes(tmp_path) == available


def test_a_system_without_proc_counts_free_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sysconf_names", {"SC_AVPHYS_PAGES": 1})
    monkeypatch.setattr("os.sysconf", {"SC_AVPHYS_PAGES": 1000, "SC_PAGE_SIZE": 4096}.__getitem__)
    assert available_bytes(tmp_path) == 4_096_000


def test_the_step_that_is_reported_is_the_one_that_is_taken() -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks.toml")
    told = describe(Model(scenario))
    assert told.step == build_world(Model(scenario)).controls[0].step
    assert told.steps * told.step == pytest.approx(scenario.time.end, abs=told.step)


def test_walls_of_their_own_material_are_pairs_too() -> None:
    walls = [{"from": [1, 0], "to": [1, 1], "material": "oak"}, {"from": [2, 0], "to": [2, 1]}]
    oak = {"density": 700, "young_modulus": 11e9, "poisson_ratio": 0.3}
    values = {"materials.oak": oak, "walls": walls, "pairs.aluminium.oak.friction": 0.6}
    scenario = load_scenario(SCENARIOS / "slide.toml", values)
    pairs = {pair.pair: pair for pair in describe(Model(scenario)).pairs}
    assert list(pairs) == ["aluminium - ground", "aluminium - aluminium", "aluminium - wall of oak"]
    assert [pair.static_friction for pair in pairs.values()] == [0.38, 0.31, 0.6]
    assert pairs["aluminium - wall of oak"].rules["friction"] == "pairs.aluminium.oak.friction"


def test_frames_that_go_into_a_folder_take_no_memory() -> None:
    shipped = SCENARIOS / "tower.toml"
    coarse, fine = (describe(Model(load_scenario(shipped, [f"output.every={every}"]))) for every in (0.01, 1e-5))
    assert fine.memory == coarse.memory
    assert 200e6 < coarse.memory < 220e6  # measured: 207 MB
