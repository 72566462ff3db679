"""blocksim animate: animations of finished and killed runs."""

from pathlib import Path

import pytest
from PIL.GifImagePlugin import GifImageFile

from tests.cli.conftest import Command

QUICK = ("--speed", "1", "--fps", "10", "--width", "240")


def test_animation_has_the_name_of_the_scenario_and_is_reported(blocksim: Command, finished: Path) -> None:
    answer = blocksim("animate", finished, *QUICK)
    assert (answer.code, answer.out) == (0, "")
    assert answer.err.splitlines()[-1].startswith("animation: three_blocks_nominal.gif (")
    with GifImageFile("three_blocks_nominal.gif") as animation:
        assert animation.width == 240
        assert animation.n_frames >= 3
    assert blocksim("animate", finished, *QUICK, "--out", "other.gif", "--no-trails", "--quiet").err == ""
    assert Path("other.gif").read_bytes() != Path("three_blocks_nominal.gif").read_bytes()


def test_killed_run_is_shown_and_told(blocksim: Command, copied: Path) -> None:
    (copied / "run.json").unlink()
    answer = blocksim("animate", copied, *QUICK, "--out", "film.gif")
    assert answer.code == 0
    assert "this run was killed or is still running" in answer.err


def test_mp4_is_written(blocksim: Command, finished: Path) -> None:
    pytest.importorskip("imageio_ffmpeg", reason="MP4 needs the extra video")
    assert blocksim("animate", finished, *QUICK, "--out", "film.MP4").code == 0
    assert Path("film.MP4").read_bytes()[4:8] == b"ftyp"
