"""Run files that are damaged, or would make HDF5 read other files or more than they hold: refused, and why."""

import os
import shutil
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Scenario, place_bodies
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.stores.hdf5 import SUPERBLOCK, FrameFile, is_left_open, lookup3, read_frames
from blocksim.verification.scene import scenario_of
from tests.golden import Golden

LEDGER = ("kinetic", "potential")
X, STEP = "particles/blocks/x", "particles/blocks/step"
FRAMES = 300
Change = Callable[[h5py.File], None]


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """Return two blocks."""
    return scenario_of([{"y": 0.0125}, {"y": 0.0375}])


@pytest.fixture(scope="module")
def files(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of closed.h5 and left_open.h5, as it is on the disk while its writer is at work."""
    folder = tmp_path_factory.mktemp("files")
    with FrameFile(folder / "closed.h5", Recorder(place_bodies(scenario), 1.0, 1e-5), "", LEDGER) as sink:
        for step in range(FRAMES):
            sink.append(Frame(step, (np.full((len(MOTION), 2), step),), np.ones(len(LEDGER) + 2)))
        sink.commit()
        (folder / "left_open.h5").write_bytes((folder / "closed.h5").read_bytes())
    return folder


@pytest.fixture
def refusal(scenario: Scenario, files: Path, tmp_path: Path) -> Callable[[Change], str]:
    """Change a run file, and return why it is refused."""

    def refuse(change: Change) -> str:
        path = Path(shutil.copyfile(files / "closed.h5", tmp_path / "run.h5"))
        with h5py.File(path, "r+") as file:
            change(file)
        with pytest.raises(InvalidInputError, match=r"run\.h5: not a complete run file: ") as caught:
            read_frames(path, scenario)
        return str(caught.value).partition("run file: ")[2]

    return refuse


def put(name: str, link: object = None, **keys: Any) -> Change:
    """Put a link, or another data set, in the place of a member."""

    def change(file: h5py.File) -> None:
        del file[name]
        if link is None:
            file.create_dataset(name, **keys)
        else:
            file[name] = link

    return change


def numbers(**keys: Any) -> Change:
    return put(X, **{"shape": (FRAMES, 2), "dtype": np.float64, **keys})


def virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout((FRAMES, 2), np.float64)
    layout[:] = h5py.VirtualSource("other.h5", "x", (FRAMES, 2))
    del file[X]
    file.create_virtual_dataset(X, layout)


def crowd(file: h5py.File) -> None:
    for number in range(100):
        file[f"observables/e{number}"] = np.ones(FRAMES)


def announce(file: h5py.File) -> None:
    recount(10**9)(file)
    for name in (
        STEP,
        *(f"particles/blocks/{name}" for name in MOTION),
        *(f"observables/{n}" for n in file["observables"]),
    ):
        file[name].resize(10**9, axis=0)


def recount(count: int) -> Change:
    return lambda file: file["n_committed"].write_direct(np.array(count))


def paced(step: object) -> Change:
    return lambda file: file[STEP].attrs.create("time_step", step)


LINKS = {
    "external": h5py.ExternalLink("other.h5", "/x"),
    "nowhere": h5py.SoftLink("/nowhere"),
    "h5md": h5py.SoftLink("/h5md"),
}
LINKED = (X, "particles/blocks", "particles", "observables", "observables/kinetic", "n_committed")
UNSAFE: dict[str, Change] = {
    **{f"{name} is a link, {kind}": put(name, link) for name in LINKED for kind, link in LINKS.items()},
    "values outside": numbers(external=[("secret", 0, 16 * FRAMES)]),
    "virtual": virtual,
    **{f"packed with {name}": numbers(chunks=(4, 2), compression=name) for name in ("gzip", "lzf")},
    "texts": numbers(dtype="S4"),
    "texts of any length": numbers(dtype=h5py.string_dtype()),
    "complex": numbers(dtype=np.complex128),
    "records": numbers(dtype=[("a", np.float64)]),
    **{f"of shape {shape}": numbers(shape=shape) for shape in ((FRAMES, 3), (FRAMES,), (FRAMES, 2, 2))},
    "a crowd of energies": crowd,
    "many frames announced": announce,
    **{f"{count} frames counted": recount(count) for count in (-1, 0, FRAMES + 1, 2**62)},
    **{f"a time step of {step}": paced(step) for step in (np.nan, np.inf, -1.0, 0.0, 1e308)},
}


def test_what_is_not_as_blocksim_writes_it_is_refused_in_words(
    refusal: Callable[[Change], str], golden: Golden
) -> None:
    golden("\n".join(f"{name}: {refusal(change)}" for name, change in UNSAFE.items()), rules=["sizes"])


@pytest.mark.parametrize("step", ["x", np.ones(3)], ids=str)
def test_a_time_step_that_is_no_number_is_refused(refusal: Callable[[Change], str], step: object) -> None:
    assert refusal(paced(step))


@pytest.mark.parametrize("name", ["n_committed", X, "observables", STEP])
def test_missing_data_set_is_refused(refusal: Callable[[Change], str], name: str) -> None:
    assert refusal(lambda file: file.pop(name))


@pytest.mark.parametrize("name", [X, "contacts"])
def test_an_external_link_is_not_even_opened(refusal: Callable[[Change], str], tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / "pipe")  # who opens it waits for ever
    (tmp_path / "other.h5").symlink_to("pipe")

    def link(file: h5py.File) -> None:
        file.pop(name, None)
        file[name] = h5py.ExternalLink("other.h5", "/x")

    alarm = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("the file that the link leads to was opened"))
    signal.alarm(20)
    try:
        assert "links are not followed" in refusal(link)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, alarm)


def test_checksums_are_those_that_hdf5_writes(tmp_path: Path) -> None:
    for number in range(20):
        path = tmp_path / f"{number}.h5"
        with h5py.File(path, "w", libver="latest") as file:
            file["x"] = np.ones(100 * number)
        head = path.read_bytes()[: SUPERBLOCK.size]
        assert lookup3(head[:-4]) == int.from_bytes(head[-4:], "little")


def test_a_file_that_was_not_closed_gives_all_committed_frames(files: Path, scenario: Scenario) -> None:
    path = files / "left_open.h5"
    assert is_left_open(path)
    with pytest.raises(OSError, match="already open for write"):
        h5py.File(path, "r")
    before = path.read_bytes()
    assert read_frames(path, scenario).x[:, 0].tolist() == list(range(FRAMES))
    assert path.read_bytes() == before, "reading has changed the file"


@pytest.mark.parametrize(
    ("name", "first", "last", "told"),
    [
        *(("closed", size, None, "not a ") for size in (0, 7, 60, 3000)),
        ("left_open", 3000, None, "not a complete run file: cut off at 3000 of"),
        ("left_open", 60, 200, "not a "),  # HDF5 in SWMR mode reads structures with a wrong checksum for ever
        ("left_open", 36, 37, "not a readable HDF5 file: its superblock is damaged"),  # the address of the root group
    ],
)
def test_a_file_that_is_cut_off_or_overwritten_is_refused_at_once(
    files: Path, scenario: Scenario, tmp_path: Path, name: str, first: int, last: int | None, told: str
) -> None:
    content = bytearray((files / f"{name}.h5").read_bytes())
    content[first:last] = b"" if last is None else bytes(byte ^ 255 for byte in content[first:last])
    (tmp_path / "run.h5").write_bytes(content)
    began = time.process_time()
    with pytest.raises(InvalidInputError, match=rf"run\.h5: {told}"):
        read_frames(tmp_path / "run.h5", scenario)
    assert time.process_time() - began < 5.0


def test_a_file_of_other_bodies_or_none_is_refused(files: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="holds 2 bodies, not 1"):
        read_frames(files / "closed.h5", scenario_of([{"y": 0.0125}]))
    with pytest.raises(InputMissingError, match="no such file"):
        read_frames(tmp_path / "run.h5", scenario_of([{"y": 0.0125}]))
