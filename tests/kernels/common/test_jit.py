"""The cache of compiled kernels: never stale, reused, and not needed; compiled and interpreted kernels agree."""

from __future__ import annotations

import logging
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.common import jit
from blocksim.kernels.common.arrays import PAIR, zeros

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from blocksim.kernels.common.arrays import Record
    from tests.conftest import Simulation

PACKAGE = Path(jit.__file__).parents[2]
SCENARIO = Path(__file__).parents[3] / "scenarios" / "three_blocks.toml"

# a kernel of history.py, which knows the law in laws.py by an import only
PUSH = """
from blocksim.kernels.common import jit
from blocksim.kernels.common.arrays import CONTACT, INTERACTION, zeros
from blocksim.kernels.explicit.history import shear_stiffness_before

contact = zeros(1, CONTACT)[0]
contact.depth = 2e-6
values = zeros(1, INTERACTION)[0]
values.shear_ratio = 1.0
stiffness = shear_stiffness_before(contact, 1e9, values, 1.0)
stats = shear_stiffness_before.for_python.stats
hits, misses = (sum(counts.values()) for counts in (stats.cache_hits, stats.cache_misses))
print(2e-6 * stiffness, hits, misses, jit.cache_folder())
"""

COLLAPSE = """
import sys
import numpy as np
from blocksim.kernels.explicit.step import advance
from blocksim.scenario import load_scenario
from blocksim.world.build import build_world

for n, (model, law, steps) in enumerate(word.split(",") for word in sys.argv[3:]):
    values = {"contact.stiffness_scale": 1e-4, "contact.particle_spacing": 0.004}
    scenario = load_scenario(sys.argv[1], {**values, "contact.model": model, "contact.law": law})
    world = build_world(scenario)
    world.bodies.y[1] += 0.5e-6
    world.bodies.spin[2] = -3.0
    if model == "particles":  # corners are rounded: they begin above the ground
        world.bodies.vy[:-1] = -1.0
    advance(world, int(steps))
    np.savez(sys.argv[2] + f"{n}.npz", **{key: part for key, part in world._asdict().items() if part is not None})
"""
RUNS = ["surface,linear,200", "surface,hertz-mindlin,60", "kernel,linear,40", "particles,linear,40"]


def python(program: str, *arguments: str | Path, folder: Path, **environment: str) -> list[str]:
    """Run a program in a process of its own that imports the package from `folder`; return the words it prints."""
    process = subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(folder), **environment},
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    )
    return process.stdout.split()


@pytest.fixture
def copied_kernels(tmp_path: Path) -> Path:
    """Return a folder with a copy of the kernels that a test may edit."""
    folder = tmp_path / "copy"
    (folder / "blocksim").mkdir(parents=True)
    (folder / "blocksim" / "__init__.py").touch()
    shutil.copytree(PACKAGE / "kernels", folder / "blocksim" / "kernels", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.mark.usefixtures("compiler")
def test_second_process_takes_kernels_from_the_cache_until_a_law_in_another_file_is_edited(
    copied_kernels: Path, tmp_path: Path
) -> None:
    def run() -> list[str]:
        return python(PUSH, folder=copied_kernels, BLOCKSIM_CACHE_DIR=str(tmp_path / "cache"))

    first, second = run(), run()
    assert first[1:3] == ["0", "1"]
    assert second[1:3] == ["1", "0"]
    assert first[3].startswith(str(tmp_path / "cache"))
    assert float(first[0]) == float(second[0]) == pytest.approx(2e3)
    law = copied_kernels / "blocksim" / "kernels" / "explicit" / "laws.py"
    law.write_text(law.read_text().replace("exponent * stiffness *", "3.0 * exponent * stiffness *"))
    assert float(run()[0]) == pytest.approx(6e3)


@pytest.fixture
def fresh_folder_choice() -> Iterator[None]:
    """Forget the chosen cache folder before and after a test."""
    jit.cache_folder.cache_clear()
    yield
    jit.cache_folder.cache_clear()


@pytest.fixture
def file_in_the_way(tmp_path: Path) -> Path:
    """Return a path below which nothing can be written, not even by root."""
    file = tmp_path / "file"
    file.touch()
    return file / "cache"


@pytest.mark.usefixtures("fresh_folder_choice")
def test_cache_folder_falls_back_to_the_temporary_one(
    file_in_the_way: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(file_in_the_way))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    folder = jit.cache_folder()
    assert folder is not None
    assert folder.is_relative_to(tmp_path / "temporary")
    assert folder.name == jit.source_hash()


REFUSED = {
    "group": (0o770, 0o755),
    "all": (0o777, 0o755),
    "all, sticky": (0o1777, 0o755),
    "all, a folder above": (0o700, 0o777),
    "group, a folder above": (0o700, 0o770),
}


@pytest.fixture
def chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Choose a cache folder, inside another one; the temporary folder is there as well."""
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(tmp_path / "above" / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: None)  # a worker process tells nothing
    (tmp_path / "above" / "cache").mkdir(parents=True)
    return tmp_path / "above" / "cache"


@pytest.mark.usefixtures("fresh_folder_choice")
@pytest.mark.parametrize("modes", REFUSED.values(), ids=REFUSED)
def test_cache_folder_that_others_may_write_is_refused_with_a_line(
    chosen: Path, modes: tuple[int, int], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(jit, "_is_group_of_one", lambda _: False)
    chosen.chmod(modes[0])
    chosen.parent.chmod(modes[1])
    with caplog.at_level(logging.WARNING, "blocksim"):
        folder = jit.cache_folder()
    assert folder is not None
    assert folder.is_relative_to(tempfile.gettempdir())
    assert list(chosen.iterdir()) == []
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith(f"{chosen}: other users may write ")
    assert line.endswith(f"; compiled kernels are kept in {folder.parent}")


@pytest.mark.usefixtures("fresh_folder_choice")
def test_cache_folder_of_another_user_is_refused_with_a_line(
    chosen: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    other = os.getuid() + 1
    monkeypatch.setattr(os, "getuid", lambda: other)
    with caplog.at_level(logging.WARNING, "blocksim"):
        assert jit.cache_folder() is None
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith(f"{chosen}: other users may write there; compiled kernels are not kept")


@pytest.mark.usefixtures("fresh_folder_choice")
@pytest.mark.parametrize("way", ["sticky folder above", "link"])
def test_cache_folder_that_only_this_user_may_write_serves(
    chosen: Path, way: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    if way == "link":
        (chosen.parent.parent / "link").symlink_to(chosen.parent)
        monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(chosen.parent.parent / "link" / "cache"))
    else:
        chosen.parent.chmod(0o1777)
    assert jit.cache_folder() == chosen / jit.source_hash()
    assert caplog.records == []


def test_compiled_code_of_another_user_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "source" / "module" / "code.nbc"
    jit._write(file, b"code")
    assert jit._read(file) == b"code"
    fstat, other = os.fstat, os.getuid() + 1

    def of_another(number: int) -> os.stat_result:
        state = fstat(number)
        return os.stat_result((*state[:4], other, *state[5:]))

    monkeypatch.setattr(os, "fstat", of_another)
    assert jit._read(file) is None


@pytest.mark.usefixtures("fresh_folder_choice", "compiler")
def test_without_any_writable_folder_kernels_are_compiled_and_not_kept(
    file_in_the_way: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(file_in_the_way))
    monkeypatch.setattr(tempfile, "tempdir", str(file_in_the_way))
    assert jit.cache_folder() is None
    assert not jit.is_compiled()
    jit.mark("seen")
    assert not jit.is_marked("seen")

    def double(number: float) -> float:
        return 2.0 * number

    assert jit.kernel(double)(3.0) == 6.0


def test_compiled_advance_is_found_once_it_has_run(start_shipped: Callable[..., Simulation]) -> None:
    start_shipped("slide")
    assert jit.is_compiled()


def test_cache_root_follows_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("BLOCKSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert jit.cache_root() == Path("/somewhere/blocksim")
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", "/elsewhere")
    assert jit.cache_root() == Path("/elsewhere")


def test_hash_sees_every_source_below_the_folder(copied_kernels: Path) -> None:
    folder = copied_kernels / "blocksim" / "kernels"
    assert jit.source_hash(folder) == jit.source_hash()
    seen = {jit.source_hash(folder)}
    deepest = folder / "explicit" / "models" / "smoothed.py"
    for path in (folder / "common" / "shapes.py", deepest):
        path.write_text(path.read_text() + "# edited\n")
        seen.add(jit.source_hash(folder))
    deepest.rename(deepest.with_name("smooth.py"))
    seen.add(jit.source_hash(folder))
    assert len(seen) == 4


def test_interpreted_kernels_give_what_compiled_ones_give(tmp_path: Path) -> None:
    for name, disabled in (("compiled", "0"), ("interpreted", "1")):
        python(COLLAPSE, SCENARIO, tmp_path / name, *RUNS, folder=PACKAGE.parent, NUMBA_DISABLE_JIT=disabled)
    for n, run in enumerate(RUNS):
        compiled, interpreted = (np.load(tmp_path / f"{name}{n}.npz") for name in ("compiled", "interpreted"))
        assert compiled["clock"]["steps"] == interpreted["clock"]["steps"] == int(run.split(",")[2])
        assert compiled["pairs"]["active"].max() > 0
        assert compiled["ledger"]["dashpot"] > 0.0
        for array in ("bodies", "contacts", "operators", "ledger", "clock", "pairs"):
            for field in compiled[array].dtype.names:
                one, two = compiled[array][field], interpreted[array][field]
                size = max(1.0, float(np.abs(one[np.isfinite(one)]).max()))  # the half-plane has an infinite side
                np.testing.assert_allclose(two, one, rtol=0.0, atol=1e-12 * size, err_msg=f"{run}: {array}.{field}")


@pytest.mark.usefixtures("fresh_folder_choice", "compiler")
def test_marks_and_compiled_kernels_are_found_for_this_source_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BLOCKSIM_CACHE_DIR", str(tmp_path))
    below = tmp_path / jit.source_hash() / "kernels"
    assert not jit.is_marked("seen")
    assert not jit.is_compiled()
    jit.mark("seen")
    below.mkdir(parents=True)
    (below / "step.advance_alone-1.py311.1.nbc").touch()
    assert jit.is_marked("seen")
    assert jit.is_compiled()
    assert not jit.is_marked("unseen")
    monkeypatch.setattr(jit, "source_hash", lambda: "another")
    jit.cache_folder.cache_clear()
    assert not jit.is_marked("seen")
    assert not jit.is_compiled()


@pytest.mark.usefixtures("compiler")
def test_kernel_is_compiled_once_whatever_integers_it_is_called_with(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "cache_folder", lambda: None)

    @jit.rare_kernel
    def twice(number: int) -> int:
        return 2 * number

    @jit.entry_kernel
    def add_up(pair: Record) -> int:
        return twice(3) + twice(pair.a) + twice(pair.near) + twice(pair.axis)

    pair = zeros(1, PAIR)[0]
    pair.a, pair.near, pair.axis = 4_000_000_000, 60_000, 200
    assert add_up(pair) == 2 * (3 + 4_000_000_000 + 60_000 + 200)
    assert [str(one) for (one,) in twice.overloads] == ["int64"]  # type: ignore[attr-defined]
