"""Animations: frames chosen by time, the last one held, blocks where they were recorded, and clear refusals."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL.GifImagePlugin import GifImageFile

from blocksim.errors import OutputError
from blocksim.scenario import Model
from blocksim.scenario.motion import MotionPieces
from blocksim.simulation.trajectory import Frames
from blocksim.view.animation import Animation, Look, Pace, Pixels, beyond_view, draw_animation, frame_times
from blocksim.view.paints import PAINTS
from blocksim.view.run_data import Support
from blocksim.view.style import BLOCK_COLOURS
from tests.view.made_up import toppling

SCENARIOS = Path(__file__).parents[2] / "scenarios"
FAST = Pace(speed=1.0, rate=10.0)
SMALL = Look(width=240)
MOVING = Support(motion=MotionPieces(np.array([0.0, 1.0]), np.array([[0.0, 0.02, 0.0, 0.0]]), 0.02))


def colour(index: int) -> list[int]:
    return [round(255 * part) for part in to_rgb(BLOCK_COLOURS[index])]


def pixel_of(animation: Animation, picture: Pixels, x: float, y: float) -> list[int]:
    """Return the colour at a place (mm) of the scene."""
    column, row = animation.canvas.scene.transform((x, y))
    return [int(part) for part in picture[len(picture) - 1 - int(row), int(column)]]


def near_the_centre(frames: Frames, frame: int, block: int) -> tuple[float, float]:
    """Return a place (mm) beside the name of a block."""
    return 1000.0 * float(frames.x[frame, block]) + 9.0, 1000.0 * float(frames.y[frame, block]) - 9.0


@pytest.mark.parametrize("paint", PAINTS)
@pytest.mark.parametrize("support", [Support(), MOVING, Support(tilt=0.2)], ids=["level", "moving", "tilted"])
def test_blocks_are_where_they_were_recorded_in_the_colours_of_other_pictures(support: Support, paint: str) -> None:
    frames = toppling(2)
    frames.vx[:, 1] *= 2.0
    painted = PAINTS[paint](frames, Model(SCENARIOS / "slope.toml"))
    animation = Animation(frames, support, Look(width=400, trails=paint == "block", paint=painted))
    for frame in (0, 20, 39, 0):  # any order
        picture = animation.picture(frame)
        for block in range(2):
            expected = [round(255 * part) for part in to_rgb(painted.fills(frame)[block])]
            assert pixel_of(animation, picture, *near_the_centre(frames, frame, block)) == expected


def test_a_moving_support_moves() -> None:
    frames = toppling(1)
    frames.x[:], frames.y[:], frames.angle[:] = 0.0, 0.025, 0.0
    still, moving = (Animation(frames, support, Look(240, trails=False)) for support in (Support(), MOVING))
    assert np.array_equal(still.picture(10)[60:], still.picture(39)[60:])  # but for the time
    assert not np.array_equal(moving.picture(10)[60:], moving.picture(39)[60:])


@pytest.mark.parametrize("width", [200, 401, 1234])
def test_sides_are_even_the_width_is_the_one_asked_for_and_a_tower_stays_within_the_page(width: int) -> None:
    high = toppling(1)
    high.y[:, 0] = np.linspace(3.0, 0.0, len(high))
    for frames in (toppling(60), high):
        height, across, _ = Animation(frames, Support(), Look(width)).picture(0).shape
        assert height % 2 == across % 2 == 0
        assert abs(across - width) <= 1
        assert height < 1.6 * across


def test_pictures_are_even_in_time_and_the_last_frame_is_shown_and_held() -> None:
    frames = toppling(1, steps=601)  # a millisecond apart
    chosen, seconds = frame_times(frames, np.arange(601), Pace(speed=0.25, rate=30.0))
    assert chosen[:4].tolist() == [0, 8, 17, 25]  # 8.33 ms apart
    assert chosen[-1] == 600
    assert len(chosen) == 73
    assert seconds[0] == pytest.approx(1.0 / 30.0)
    assert seconds[-1] > 1.0
    uneven = replace(toppling(1, steps=4), time=np.array([0.0, 0.1, 0.11, 0.5]))
    assert frame_times(uneven, np.arange(4), FAST)[0].tolist() == [0, 1, 2, 2, 3, 3]
    chosen, seconds = frame_times(uneven, np.array([3]), FAST)
    assert (chosen.tolist(), len(seconds)) == ([3], 1)


def test_gif_plays_as_long_as_it_should_in_the_blocks_own_colours_with_the_same_bytes(tmp_path: Path) -> None:
    frames, look, paths = toppling(6), Look(400), [tmp_path / f"{number}.gif" for number in (1, 2)]
    for path in paths:
        assert draw_animation(frames, path, Pace(0.5, 30.0), look) == (37, "")
    assert paths[0].read_bytes() == paths[1].read_bytes()
    length = 0
    with GifImageFile(paths[0]) as animation:
        for index in range(animation.n_frames):
            animation.seek(index)
            length += animation.info["duration"]
        assert animation.info["loop"] == 0
        last = np.asarray(animation.convert("RGB"))
    assert length == pytest.approx(1000 * (36 / 30 + 1.5), abs=10)
    drawn = Animation(frames, Support(), look)
    for block in range(6):
        assert pixel_of(drawn, last, *near_the_centre(frames, -1, block)) == colour(block)
    assert last[0, 0].tolist() == [255, 255, 255]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # the reader leaves its pipes open
def test_mp4_can_be_read_back(tmp_path: Path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="MP4 needs the extra video")
    path = tmp_path / "film.MP4"
    frames = toppling(2)
    draw_animation(frames, path, FAST, Look(301, title="animation"))
    reader = ffmpeg.read_frames(str(path))
    told = next(reader)
    pictures = list(reader)
    animation = Animation(frames, Support(), Look(301))
    assert told["size"] == animation.picture(0).shape[1::-1]
    assert len(pictures) == 6 + 15  # seven, the last one of them for 1.5 s
    last = np.frombuffer(pictures[-1], np.uint8).reshape(animation.picture(0).shape)
    found = pixel_of(animation, last, *near_the_centre(frames, -1, 1))
    assert np.abs(np.subtract(found, colour(1))).max() < 16  # as lossy as MP4 is
    assert [one.name for one in tmp_path.iterdir()] == ["film.MP4"]


def ffmpeg_of(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return where the only ffmpeg that is found may be put."""
    (folder / "bin").mkdir()
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", f"{folder / 'bin'}:/usr/bin:/bin")
    return folder / "bin" / "ffmpeg"


def test_the_system_s_ffmpeg_writes_mp4_where_the_package_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = pytest.importorskip("imageio_ffmpeg", reason="no ffmpeg to stand for the system's")
    program = package.get_ffmpeg_exe()  # before the package is missing
    ffmpeg_of(tmp_path, monkeypatch).symlink_to(program)
    draw_animation(toppling(2), tmp_path / "film.mp4", FAST, SMALL)
    written, seconds = package.count_frames_and_secs(str(tmp_path / "film.mp4"))
    assert (written, seconds) == (6 + 15, pytest.approx(2.1, abs=0.01))


@pytest.mark.parametrize("program", ["exit 1", "head -c 1000 >/dev/null; exit 1", "cat >/dev/null; exit 3"])
def test_a_film_that_the_system_s_ffmpeg_does_not_finish_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str
) -> None:
    ffmpeg = ffmpeg_of(tmp_path, monkeypatch)
    ffmpeg.write_text(f"#!/bin/sh\n{program}\n", encoding="utf-8")
    ffmpeg.chmod(0o755)
    with pytest.raises(OutputError, match=r"film\.mp4: cannot be written: ffmpeg stopped before the end"):
        draw_animation(toppling(1), tmp_path / "film.mp4", FAST, SMALL)
    assert [one.name for one in tmp_path.iterdir()] == ["bin"]


def test_blocks_far_from_one_another_stay_in_the_window_but_one() -> None:
    two, three = toppling(2), toppling(3)
    for frames in (two, three):
        frames.x[:, 1] += 5.0
    three.y[:, 2] += 5.0
    assert [Animation(frames, Support(), SMALL).seen.sum() for frames in (two, three)] == [2, 2]


def test_pictures_say_which_blocks_leave_the_view() -> None:
    frames = toppling(60)
    frames.x[-1, 59] += 5.0
    film = Animation(frames, Support(), Look(width=400))
    assert film.beyond == "block 60 leaves the view"
    assert film.beyond in [text.get_text() for text in film.canvas.axes.texts]
    near = Animation(toppling(60), Support(), SMALL).canvas.axes.texts
    assert not any("the view" in text.get_text() for text in near)
    assert beyond_view(frames.names, np.arange(60) >= 2) == "blocks 1 and 2 leave the view"
    assert beyond_view(frames.names, np.arange(60) >= 3) == "3 of 60 blocks leave the view"


def test_trails_are_drawn_for_few_blocks_unless_somebody_decides() -> None:
    assert Animation(toppling(3), Support(), SMALL).has_trails
    assert not Animation(toppling(31), Support(), SMALL).has_trails
    without, with_trails = (
        Animation(toppling(1), Support(), Look(240, trails=one)).picture(39) for one in (False, True)
    )
    assert not np.array_equal(without, with_trails)
