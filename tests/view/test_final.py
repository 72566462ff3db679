"""The final state: labels and measured ranges below their blocks, turns counted from the start."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.simulation.trajectory import final_columns
from blocksim.view.final import draw_final
from blocksim.view.history import draw_history
from blocksim.view.paints import by_turn
from blocksim.view.scene import PictureOptions
from tests.view.drawings import TABLE
from tests.view.made_up import boxes_of, stacked, toppling
from tests.view.test_loads import support


def test_labels_and_measured_ranges_stand_below_what_they_are_about(caught: list[Figure]) -> None:
    frames = toppling(3)
    draw_final(frames, "final.png", PictureOptions(measured=TABLE))
    panel, _ = caught[0].axes
    boxes = dict(boxes_of(caught[0]))
    for place in 1000.0 * frames.x[-1]:
        box = boxes[f"x {place:.2f} mm"]
        assert 0.5 * (box[0] + box[2]) == pytest.approx(panel.transData.transform((place, 0.0))[0], abs=1.0)
    ends = panel.transData.transform([(71.69, 0.0), (78.53, 0.0)])[:, 0]
    bars = [line.get_transform().transform(line.get_xydata())[:, 0] for line in panel.lines]
    assert any(len(bar) == 2 and np.allclose(bar, ends, atol=0.5) for bar in bars)


def test_rotation_counts_from_the_start_and_is_not_wrapped(caught: list[Figure]) -> None:
    frames = toppling(1)
    frames.angle[:, 0] = np.linspace(np.pi, 4.0 * np.pi, len(frames))
    frames.start_angle[0] = np.pi
    draw_final(frames, "final.png")
    assert "540.00°" in [text for text, _ in boxes_of(caught[0])]


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


def test_loads_are_drawn_and_explained_with_room_for_what_acts_on_all_blocks(caught: list[Figure]) -> None:
    force: dict[str, object] = {"kind": "force", "body": "1", "magnitude": "20 N"}
    loads = [force, {"kind": "horizontal", "magnitude": 0.1}]
    draw_final(toppling(1), "final.png", PictureOptions(support=support(loads)))
    draw_final(toppling(1), "final.png")
    loaded, bare = (dict(boxes_of(figure)) for figure in caught)
    assert any("Red arrows: loads, the longest 20 N." in text.replace("\n", " ") for text in loaded)
    assert set(loaded) - set(bare) >= {"0.1 g"}
    panel = caught[0].axes[0].get_window_extent()
    assert loaded["0.1 g"][1] > panel.y1  # above the panel
    assert loaded["0.1 g"][3] < caught[0].bbox.height - 72.0 * 0.1  # below the time
