"""Run files that would make the HDF5 library read other files, or far more than they hold."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, place_bodies, scenario_from_mapping
from blocksim.simulation.instruments import MOTION, Frame, Recorder
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames

LEDGER = ("kinetic", "potential")
X = "particles/blocks/x"
Change = Callable[[h5py.File], None]


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    """Return two blocks."""
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "two",
            "structures": [{"kind": "stack", "block": "brick", "count": 2}],
            "materials": {"steel": {"density": 7850, "young_modulus": 210e9, "poisson_ratio": 0.3}},
            "blocks": {"brick": {"width": 0.04, "height": 0.02, "length": 0.06, "material": "steel"}},
        }
    )


@pytest.fixture
def refusal(scenario: Scenario, tmp_path: Path) -> Callable[[Change], str]:
    """Change a run file of four frames, and return why it is refused."""
    path = tmp_path / "run.h5"
    with FrameFile(path, Recorder(place_bodies(scenario), 1.0, 1e-5), "", LEDGER) as sink:
        for step in range(4):
            sink.append(Frame(step, (np.ones((len(MOTION), 2)),), np.ones(len(LEDGER) + 2)))

    def refuse(change: Change) -> str:
        assert len(read_frames(path, scenario)) == 4
        with h5py.File(path, "r+") as file:
            change(file)
        with pytest.raises(InvalidInputError, match=r"run\.h5: not a complete run file: ") as caught:
            read_frames(path, scenario)
        return str(caught.value)

    return refuse


def instead(name: str, make: Callable[[h5py.File], object]) -> Change:
    """Put something else in the place of a member."""

    def change(file: h5py.File) -> None:
        del file[name]
        made = make(file)
        if made is not None:
            file[name] = made

    return change


@pytest.mark.parametrize(
    "name", [X, "particles/blocks", "particles", "observables", "observables/kinetic", "n_committed"]
)
@pytest.mark.parametrize(
    "link", [h5py.ExternalLink("other.h5", "/x"), h5py.SoftLink("/nowhere"), h5py.SoftLink("/h5md")]
)
def test_links_are_not_followed(refusal: Callable[[Change], str], name: str, link: object) -> None:
    assert "links are not followed" in refusal(instead(name, lambda _: link))


@pytest.mark.parametrize("name", [X, "contacts"])
def test_an_external_link_is_not_even_opened(refusal: Callable[[Change], str], tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / "pipe")  # who opens it waits for ever
    (tmp_path / "other.h5").symlink_to("pipe")

    def link(file: h5py.File) -> None:
        if name == X:
            del file[name]
        file[name] = h5py.ExternalLink("other.h5", "/x")

    alarm = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("the file that the link leads to was opened"))
    signal.alarm(20)
    try:
        assert "links are not followed" in refusal(link)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, alarm)


def test_external_storage_is_not_read(refusal: Callable[[Change], str], tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(bytes(64))

    def outside(file: h5py.File) -> None:
        file.create_dataset(X, (4, 2), np.float64, external=[(str(tmp_path / "secret"), 0, 64)])

    assert "are in other files" in refusal(instead(X, outside))


def test_virtual_data_sets_are_not_read(refusal: Callable[[Change], str]) -> None:
    def virtual(file: h5py.File) -> None:
        layout = h5py.VirtualLayout((4, 2), np.float64)
        layout[:] = h5py.VirtualSource("other.h5", "x", (4, 2))
        file.create_virtual_dataset(X, layout)

    assert "are in other files" in refusal(instead(X, virtual))


@pytest.mark.parametrize("compression", ["gzip", "lzf"])
def test_compressed_frames_are_not_unpacked(refusal: Callable[[Change], str], compression: str) -> None:
    def bomb(file: h5py.File) -> None:
        file.create_dataset(X, (4, 2), np.float64, chunks=(4, 2), compression=compression)

    assert "compressed" in refusal(instead(X, bomb))


def test_more_frames_than_the_file_can_hold_are_not_read(refusal: Callable[[Change], str]) -> None:
    def announce(file: h5py.File) -> None:
        file["n_committed"][()] = 10**9
        names = ["particles/blocks/step", *(f"particles/blocks/{name}" for name in MOTION)]
        names += [f"observables/{name}" for name in file["observables"]]
        for name in names:
            file[name].resize(10**9, axis=0)

    assert "announces" in refusal(announce)


@pytest.mark.parametrize("count", [-1, 0, 5, 2**62])
def test_counts_of_frames_that_are_not_there_are_refused(refusal: Callable[[Change], str], count: int) -> None:
    def recount(file: h5py.File) -> None:
        file["n_committed"][()] = count

    assert "frames" in refusal(recount)


@pytest.mark.parametrize(
    "value",
    [
        np.array([[b"text"] * 2] * 4),
        np.ones((4, 2), dtype=np.complex128),
        np.ones((4, 2), dtype=[("a", np.float64)]),
        np.ones((4, 3)),
        np.ones(4),
        np.ones((4, 2, 2)),
    ],
)
def test_values_that_are_no_table_of_numbers_are_refused(refusal: Callable[[Change], str], value: Any) -> None:
    def replace(file: h5py.File) -> None:
        file.create_dataset(X, data=value)

    assert refusal(instead(X, replace))


def test_texts_of_any_length_are_refused(refusal: Callable[[Change], str]) -> None:
    def texts(file: h5py.File) -> None:
        file.create_dataset(X, (4, 2), h5py.string_dtype())

    assert "not plain numbers" in refusal(instead(X, texts))


def test_a_crowd_of_energies_is_refused(refusal: Callable[[Change], str]) -> None:
    def crowd(file: h5py.File) -> None:
        for number in range(100):
            file[f"observables/e{number}"] = np.ones(4)

    assert "members" in refusal(crowd)


@pytest.mark.parametrize("step", [np.nan, np.inf, -1.0, 0.0, 1e308, "x", np.ones(3)])
def test_time_steps_that_make_no_times_are_refused(refusal: Callable[[Change], str], step: Any) -> None:
    def change(file: h5py.File) -> None:
        file["particles/blocks/step"].attrs["time_step"] = step

    assert refusal(change)
