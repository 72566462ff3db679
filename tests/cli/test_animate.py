"""blocksim animate: animations of finished and killed runs."""

from pathlib import Path

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
