"""blocksim plot: pictures of finished, failed and damaged runs."""

from pathlib import Path

import pytest

from tests.cli.conftest import SOFT, Command


def test_picture_is_written_and_told(blocksim: Command, finished: Path) -> None:
    answer = blocksim("plot", finished, "--out", "strip.png")
    assert (answer.code, answer.out, answer.err) == (0, "", "picture: strip.png\n")
    assert Path("strip.png").read_bytes().startswith(b"\x89PNG")


def test_picture_has_the_name_of_the_scenario(blocksim: Command, finished: Path) -> None:
    assert blocksim("plot", finished, "--quiet", "--times", "0,0.1").err == ""
    assert Path("three_blocks_nominal.png").is_file()


def test_failed_run_can_be_drawn(blocksim: Command) -> None:
    failing = ("--set", "contact.max_overlap=1e-9", "--out", "out")
    assert blocksim("run", "scenarios/three_blocks_nominal.toml", *SOFT, *failing).code == 76
    assert blocksim("plot", "out").code == 0


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["--out", "strip.bmp"], 65, "'.bmp' is no picture format"),
        (["--out", "nix/strip.png"], 74, "nix/strip.png: cannot be written"),
        (["--times", "0,x"], 65, "--times 0,x: give times in seconds"),
        (["--times", "0,99"], 65, "outside the recorded span"),
        (["--experiment", "nix.csv"], 66, "nix.csv: no such file"),
    ],
)
def test_mistakes_are_told(blocksim: Command, finished: Path, arguments: list[str], code: int, told: str) -> None:
    answer = blocksim("plot", finished, *arguments)
    assert answer.code == code
    assert told in answer.err
    assert {path.name for path in Path().iterdir()} == {"scenarios"}


@pytest.mark.parametrize("content", [None, b"", b"rubbish" * 100])
def test_damaged_frames_are_told(blocksim: Command, copied: Path, content: bytes | None) -> None:
    (copied / "run.h5").unlink()
    if content is not None:
        (copied / "run.h5").write_bytes(content)
    answer = blocksim("plot", copied)
    assert answer.code == (66 if content is None else 65)
    assert "run.h5" in answer.err
