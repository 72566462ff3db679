"""Own pictures, animations, reports and exports are known by their marks, and files of others are not."""

import json
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from blocksim.errors import OutputError, OutputExistsError
from blocksim.simulation.files import refuse_foreign
from blocksim.view.animation import write_gif, write_mp4
from blocksim.view.style import open_figure, save_figure

PNG = b"\x89PNG\r\n\x1a\n"
REPORT = b'<meta name="generator" content="blocksim report">'
HEAD = "time_s,block,x_mm,y_mm,rotation_deg,vx_mm_s\n"
OTHERS = {
    "thesis.pdf": b"%PDF-1.5\n1 0 obj\n<< /Creator (blocksim) >>\nendobj\n2 0 obj\n<< /Creator (TeX) >>\nendobj\n"
    b"trailer\n<< /Root 3 0 R /Info 2 0 R >>\n%%EOF\n",
    "photo.png": PNG + b"\0\0\0\x0dIHDR" + bytes(17) + b"\0\0\0\x11tEXtComment\0blocksim" + bytes(4),
    "drawing.svg": b"<svg><text>blocksim</text></svg>",
    "clip.gif": b"GIF89a blocksim",
    "clip.mp4": b"\0\0\0\x10ftypisom\0\0\0\0\0\0\0\x10moovblocksim",
    "site.html": b"<html>blocksim report</html>",
    "data.csv": b"time_s,block,mass\n",
    "data.json": b'{"machine": "blocksim"}',
    "data.vtkhdf": b"\x89HDF\r\n\x1a\nVTKHDF blocksim",
    "empty": b"",
}


def draw(path: Path) -> None:
    with open_figure(2.0, 1.0) as figure:
        figure.text(0.5, 0.5, "blocksim")
        save_figure(figure, path)


def film(path: Path) -> None:
    writer = write_gif if path.suffix == ".gif" else write_mp4
    writer(path, iter([np.full((64, 64, 3), 255, dtype=np.uint8)] * 3), np.full(3, 0.1))


def vtkhdf(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_group("VTKHDF")
        file["blocksim/block_names"] = [b"1"]


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("a.png", draw),
        ("a.svg", draw),
        ("a.pdf", draw),
        ("a.gif", film),
        ("a.mp4", film),
        ("a.html", lambda path: path.write_bytes(b"<!doctype html>" + REPORT)),
        ("a.json", lambda path: path.write_text(json.dumps({"machine": {}, "measurements": []}, indent=2))),
        ("a.csv", lambda path: path.write_text(HEAD)),
        ("a.vtkhdf", vtkhdf),
    ],
)
def test_own_file_is_known_and_replaced(tmp_path: Path, name: str, write: Callable[[Path], object]) -> None:
    write(tmp_path / name)
    refuse_foreign(tmp_path / name)


@pytest.mark.parametrize("name", OTHERS)
def test_file_of_others_is_replaced_only_when_asked(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(OTHERS[name])
    with pytest.raises(OutputExistsError, match="already exists; rerun with --overwrite"):
        refuse_foreign(tmp_path / name)
    refuse_foreign(tmp_path / name, overwrite=True)


def test_missing_folder_is_told_before_the_work_begins(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"out\.gif: cannot be written: there is no folder .*/none$"):
        refuse_foreign(tmp_path / "none" / "out.gif")


@pytest.mark.parametrize("what", ["folder", "device", "link that leads nowhere"])
def test_what_is_no_file_is_never_replaced(tmp_path: Path, what: str) -> None:
    place = tmp_path / "out.png"
    if what == "folder":
        place.mkdir()
    else:
        place.symlink_to("/dev/null" if what == "device" else tmp_path / "nowhere")
    with pytest.raises(OutputExistsError, match=r"out\.png: .*write elsewhere with --out"):
        refuse_foreign(place, overwrite=True)
