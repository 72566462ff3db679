"""The final state: labels and measured ranges below their blocks, turns counted from the start."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.simulation.trajectory import final_columns
from blocksim.view.final import draw_final
from blocksim.view.history import draw_history
from blocksim.view.paints import by_turn
from blocksim.view.scene import PictureOptions
from tests.view.made_up import boxes_of, stacked


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
