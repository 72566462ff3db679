"""run.h5: every committed number comes back; damaged files, or such as lead elsewhere, are refused, and why."""

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

from blocksim.errors import InputMissingError, InvalidInputError, OutputError
from blocksim.scenario import Model, PlacedBody, Scenario
from blocksim.simulation import Result
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames
from blocksim.simulation.trajectory import CONTACT_ROW, Rows
from blocksim.verification.scene import scenario_of
from tests.golden import Golden
from tests.simulation.conftest import Shipped

UNITS = {"x": "m", "angle": "rad", "vy": "m s-1", "spin": "rad s-1", "time": "s", "mass": "kg", "inertia": "kg m2"}
SCHEME = SCHEMES["explicit"]
STEP = 1e-6  # s


@pytest.fixture(scope="module")
def scenario(soft: Shipped) -> Scenario:
    return soft(output__contacts=True)


def opened(path: Path, placed: tuple[PlacedBody, ...], *, contacts: bool = False) -> FrameFile:
    return FrameFile(path, Recorder(placed, 1.0, STEP, contacts=contacts), "schema = 1\n", SCHEME.ledger)


def table_of(step: int) -> Rows:
    """Return some contacts at places that tell them apart."""
    rows = np.zeros(step % 3, CONTACT_ROW)
    rows["x"] = step + 0.25 * np.arange(len(rows))
    rows["body_b"] = -1
    return rows


def add_frames(sink: FrameFile, first: int, last: int) -> None:
    for step in range(first, last):
        motion, measured = np.full((len(MOTION), 3), float(step)), np.full(len(SCHEME.row_names), float(step))
        sink.append(Frame(step, (motion,), measured, table_of(step)))


def test_file_alone_tells_scenario_bodies_and_units(kept: Result, folder: Path) -> None:
    units: dict[str, str] = {}

    def note_unit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            units[name.rpartition("/")[2]] = item.attrs["unit"]

    with h5py.File(folder / "run.h5", "r") as file:
        file.visititems(note_unit)
        assert bytes(file["parameters/scenario"][()]).decode() == (folder / "scenario.toml").read_text()
        np.testing.assert_allclose(file["particles/blocks/mass"][:], 0.10887, rtol=1e-4)
        np.testing.assert_array_equal(file["particles/blocks/time"][:], kept.frames.time)
        assert int(file["n_committed"][()]) == len(kept.frames)
    assert set(MOTION) | set(SCHEME.row_names) | {"step", "time", "n_committed", "scenario"} <= set(units)
    assert UNITS.items() <= units.items()
    assert {units[name] for name in ("kinetic", "potential", "friction", "dashpot")} == {"J"}


def test_every_number_comes_back_under_its_name(scenario: Scenario, tmp_path: Path) -> None:
    random, path = np.random.default_rng(1), tmp_path / "run.h5"
    rows = [(random.random((len(MOTION), 3)), random.random(len(SCHEME.row_names))) for _ in range(3)]
    written = [Frame(step, (motion,), measured) for step, (motion, measured) in zip((0, 5, 7), rows, strict=True)]
    with opened(path, Model(scenario).bodies) as sink:
        for frame in written:
            sink.append(frame)
    back = read_frames(path, Model(scenario))
    assert back.step.tolist() == [0, 5, 7]
    assert back.time.tolist() == [0.0, 5 * STEP, 7 * STEP]
    for place, name in enumerate(MOTION):
        np.testing.assert_array_equal(getattr(back, name), [frame.states[0][place] for frame in written], err_msg=name)
    energies = [*back.energy.values(), back.contact_count, back.largest_overlap]
    assert list(back.energy) == list(SCHEME.ledger)
    np.testing.assert_array_equal(np.stack(energies, axis=1), [frame.measured for frame in written])


def test_what_was_committed_is_there_under_way_and_after_a_kill(scenario: Scenario, tmp_path: Path) -> None:
    path, killed = tmp_path / "run.h5", tmp_path / "killed.h5"
    with opened(path, Model(scenario).bodies, contacts=True) as sink:
        add_frames(sink, 0, 1000)
        sink.commit()
        add_frames(sink, 1000, 1400)
        assert len(read_frames(path, Model(scenario))) == 1000
        shutil.copyfile(path, killed)  # the writer never closed this one
    for file, count in ((killed, 1000), (path, 1400)):
        frames = read_frames(file, Model(scenario))
        assert frames.contacts is not None
        assert len(frames) == len(frames.contacts) == count
        assert frames.x[-1].tolist() == [count - 1.0] * 3
        for step in (0, 1, 2, 500, count - 1):
            np.testing.assert_array_equal(frames.contacts.at(step), table_of(step))
    with h5py.File(path, "r+") as stored:
        stored["n_committed"][()] = 2  # killed after the third was written, before it was announced
    assert read_frames(path, Model(scenario)).step.tolist() == [0, 1]
    with h5py.File(path, "r+") as stored:
        stored["n_committed"][()] = 1400
        stored["contacts/normal_force"].resize(3, axis=0)
    with pytest.raises(InvalidInputError, match="contacts/normal_force: holds 3 contacts, not 1399"):
        read_frames(path, Model(scenario))


def test_outlines_are_stored_once_and_rectangles_store_none(scenario: Scenario, tmp_path: Path) -> None:
    first, *others = Model(scenario).bodies
    wedge = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))
    for placed, name in (((first, *others), "plain"), ((first._replace(outline=wedge), *others), "outlined")):
        opened(tmp_path / name, placed).close()
    with h5py.File(tmp_path / "plain") as plain, h5py.File(tmp_path / "outlined") as outlined:
        assert "outlines" not in plain["particles/blocks"]
        stored = outlined["particles/blocks/outlines"]
        assert stored.attrs["unit"] == "m"
        np.testing.assert_array_equal(stored[0], [*wedge, wedge[-1]])
        np.testing.assert_array_equal(stored[1], others[0].corners)


def test_a_file_system_without_locks_is_told_what_to_set(scenario: Scenario, tmp_path: Path) -> None:
    said = "Unable to open file (unable to lock file, errno = 37, error message = 'No locks available')"
    remedy = r"run\.h5: .*No locks available; where the file system has none, set HDF5_USE_FILE_LOCKING=FALSE$"

    def refuse(*_: object, **__: object) -> None:
        raise BlockingIOError(said)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(h5py, "File", refuse)
        with pytest.raises(OutputError, match=remedy):
            opened(tmp_path / "run.h5", Model(scenario).bodies)
    with opened(tmp_path / "run.h5", Model(scenario).bodies) as sink:
        add_frames(sink, 0, 4)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(h5py, "File", refuse)
        with pytest.raises(InvalidInputError, match=remedy):
            read_frames(tmp_path / "run.h5", Model(scenario))


def test_full_disk_is_one_message_and_the_file_stays_readable(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_room(*_: object) -> None:
        raise OSError(28, "No space left on device")

    def fill_disk() -> None:
        with opened(tmp_path / "run.h5", Model(scenario).bodies) as sink:
            add_frames(sink, 0, 4)
            sink.commit()
            monkeypatch.setattr("os.posix_fallocate", no_room)
            add_frames(sink, 4, 8)
            sink.commit()

    with pytest.raises(OutputError, match=r"run\.h5: cannot be written: No space left on device"):
        fill_disk()
    assert len(read_frames(tmp_path / "run.h5", Model(scenario))) == 4
    with pytest.raises(OutputError, match="No such file or directory"):
        opened(tmp_path / "nowhere" / "run.h5", Model(scenario).bodies)


LEDGER = ("kinetic", "potential")
X, STEPS = "particles/blocks/x", "particles/blocks/step"
FRAMES = 300
Change = Callable[[h5py.File], None]


@pytest.fixture(scope="module")
def two_blocks() -> Scenario:
    return scenario_of([{"y": 0.0125}, {"y": 0.0375}])


@pytest.fixture(scope="module")
def files(two_blocks: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of closed.h5 and left_open.h5, as it is on the disk while its writer is at work."""
    folder = tmp_path_factory.mktemp("files")
    with FrameFile(folder / "closed.h5", Recorder(Model(two_blocks).bodies, 1.0, 1e-5), "", LEDGER) as sink:
        for step in range(FRAMES):
            sink.append(Frame(step, (np.full((len(MOTION), 2), step),), np.ones(len(LEDGER) + 2)))
        sink.commit()
        (folder / "left_open.h5").write_bytes((folder / "closed.h5").read_bytes())
    return folder


@pytest.fixture
def refusal(two_blocks: Scenario, files: Path, tmp_path: Path) -> Callable[[Change], str]:

    def refuse(change: Change) -> str:
        path = Path(shutil.copyfile(files / "closed.h5", tmp_path / "run.h5"))
        with h5py.File(path, "r+") as file:
            change(file)
        with pytest.raises(InvalidInputError, match=r"run\.h5: not a complete run file: ") as caught:
            read_frames(path, Model(two_blocks))
        return str(caught.value).partition("run file: ")[2]

    return refuse


def put(name: str, link: object = None, **keys: Any) -> Change:

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
        STEPS,
        *(f"particles/blocks/{name}" for name in MOTION),
        *(f"observables/{n}" for n in file["observables"]),
    ):
        file[name].resize(10**9, axis=0)


def recount(count: int) -> Change:
    return lambda file: file["n_committed"].write_direct(np.array(count))


def without(name: str) -> Change:
    return lambda file: file.pop(name)


def paced(step: object) -> Change:
    return lambda file: file[STEPS].attrs.create("time_step", step)


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
    **{f"a time step of {step}": paced(step) for step in (np.nan, np.inf, -1.0, 0.0, 1e308, "x", np.ones(3))},
    **{f"without {name}": without(name) for name in ("n_committed", X, "observables", STEPS)},
}


def test_what_is_not_as_blocksim_writes_it_is_refused_in_words(
    refusal: Callable[[Change], str], golden: Golden
) -> None:
    golden("\n".join(f"{name}: {refusal(change)}" for name, change in UNSAFE.items()), rules=["sizes"])


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


def test_a_file_that_was_not_closed_gives_all_committed_frames(files: Path, two_blocks: Scenario) -> None:
    path = files / "left_open.h5"
    with pytest.raises(OSError, match="already open for write"):
        h5py.File(path, "r")
    before = path.read_bytes()
    assert read_frames(path, Model(two_blocks)).x[:, 0].tolist() == list(range(FRAMES))
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
    files: Path, two_blocks: Scenario, tmp_path: Path, name: str, first: int, last: int | None, told: str
) -> None:
    content = bytearray((files / f"{name}.h5").read_bytes())
    content[first:last] = b"" if last is None else bytes(byte ^ 255 for byte in content[first:last])
    (tmp_path / "run.h5").write_bytes(content)
    began = time.process_time()
    with pytest.raises(InvalidInputError, match=rf"run\.h5: {told}"):
        read_frames(tmp_path / "run.h5", Model(two_blocks))
    assert time.process_time() - began < 5.0


def test_a_file_of_other_bodies_or_none_is_refused(files: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="holds 2 bodies, not 1"):
        read_frames(files / "closed.h5", Model(scenario_of([{"y": 0.0125}])))
    with pytest.raises(InputMissingError, match="no such file"):
        read_frames(tmp_path / "run.h5", Model(scenario_of([{"y": 0.0125}])))
