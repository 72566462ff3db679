"""Pictures of a run: what their golden texts cannot tell, panels, windows and names."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError
from blocksim.simulation.trajectory import final_columns
from blocksim.view import strip
from blocksim.view.final import draw_final
from blocksim.view.history import draw_history
from blocksim.view.paints import by_block, by_speed, by_turn
from blocksim.view.run_data import Extent, Support, extent_of
from blocksim.view.scene import Canvas, PictureOptions, Scene, draw_scene, readable_scale
from blocksim.view.strip import arrangement
from blocksim.view.style import open_figure
from tests.golden import Golden
from tests.view.made_up import blocks_at, boxes_of, stacked, toppling


def test_rotation_of_what_turned_while_settling_is_that_of_the_table(caught: list[Figure]) -> None:
    frames = stacked(1)
    frames.angle[:] = np.radians(1.24)  # from the first frame on, which is after settling
    (rotation,) = final_columns(frames)["rotation_deg"]
    draw_final(frames, "final.png")
    draw_history(frames, "history.png", PictureOptions(panels=("rotation",)))
    assert f"{rotation:.2f}°" == "1.24°" in [text for text, _ in boxes_of(caught[0])]
    (curve,) = (line for axes in caught[1].axes for line in axes.lines if np.size(line.get_xdata()) == len(frames))
    assert np.asarray(curve.get_ydata())[-1] == pytest.approx(rotation)
    scale = by_turn(frames).scale
    assert scale is not None
    assert scale.high == pytest.approx(rotation)


def test_long_runs_are_thinned_and_many_grey_lines_stored_as_an_image(tmp_path: Path) -> None:
    draw_history(toppling(200, steps=3000), tmp_path / "history.svg")
    assert (tmp_path / "history.svg").stat().st_size < 2_000_000


def test_what_a_run_does_not_have_or_lines_cannot_show_is_refused(golden: Golden) -> None:
    said = []
    for values in (
        {"panels": ("speeed",)},
        {"blocks": ("9",)},
        {"panels": ("force",)},
        {"paint": by_speed(toppling(3))},
    ):
        with pytest.raises(InvalidInputError) as caught:
            draw_history(toppling(3), "history.png", PictureOptions(**values))
        said.append(str(caught.value))
    golden("\n".join(said))


@pytest.mark.parametrize(
    ("extent", "readable", "expected"),
    [
        (Extent(0, 160, 0, 150), 0.0, (4, 8)),
        (Extent(0, 500, 0, 100), 0.0, (2, 8)),
        (Extent(0, 900, 0, 50), 0.0, (1, 6)),
        (Extent(0, 800, 0, 400), 0.3, (2, 8)),  # names need larger panels
        (Extent(0, 800, 0, 400), 0.1, (4, 8)),  # readable as it is
        (Extent(0, 800, 0, 400), 5.0, (4, 8)),  # not readable either way
        (Extent(0, 400, 0, 400), 0.5, (4, 8)),
    ],
)
def test_long_scenes_and_small_names_get_fewer_columns(
    extent: Extent, readable: float, expected: tuple[int, int]
) -> None:
    assert arrangement(extent, readable=readable) == expected


def test_importing_the_room_does_not_load_matplotlib() -> None:
    code = "import sys, blocksim.view; sys.exit('matplotlib' in sys.modules or 'pandas' in sys.modules)"
    root = Path(strip.__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", code], cwd=root, check=False).returncode == 0


@pytest.mark.parametrize(("share", "name"), [(1.01, "1"), (0.99, "")])
def test_names_are_readable_from_the_scale_at_which_they_are_written(share: float, name: str) -> None:
    frames = blocks_at([0.1, 0.2], [0.025, 0.016], [0.0, -np.pi / 2])
    extent = extent_of(frames, np.arange(2), Support())
    with open_figure(1.0, 1.0) as figure:
        canvas = Canvas(figure.add_axes((0.0, 0.0, 1.0, 1.0)), extent, share * readable_scale(frames))
        draw_scene(canvas, Scene(frames, Support(), by_block(frames)), 1)
    assert "".join(text.get_text() for text in canvas.axes.texts) == name
