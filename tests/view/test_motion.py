"""The picture of the supports' motion."""

from pathlib import Path

import numpy as np

from blocksim.scenario.motion import motion_pieces
from blocksim.view.run_data import Support
from blocksim.view.time_panels import MOST_POINTS, draw_support_motion, thin_line
from tests.scenario.test_motion import END, scenario

PULSE = {"kind": "pulse", "shape": "rectangular", "amplitude": "0.5 g", "duration": 0.1, "start": 0.2}


def test_the_peaks_and_what_stays_are_printed(tmp_path: Path) -> None:
    path = tmp_path / "motion.svg"
    draw_support_motion(Support(motion=motion_pieces(scenario(PULSE))), END, path, "pulse")
    texts = path.read_text(encoding="utf-8")
    for told in ("PGA 4.903 m/s²", "= 0.5 g", "PGV 490.3 mm/s", "PGD 1348 mm", "At the end: 490.3 mm/s, 1348 mm."):
        assert f"{told}" in texts


def test_a_thinned_line_keeps_its_peaks() -> None:
    time = np.arange(100_000.0)
    values = np.sin(time)
    values[[123, 77_777]] = 5.0, -7.0
    kept, drawn = thin_line(time, values)
    assert len(kept) <= MOST_POINTS
    assert (drawn.max(), drawn.min()) == (5.0, -7.0)
    assert (kept[0], kept[-1]) == (0.0, 99_999.0)
    assert np.all(np.diff(kept) > 0)
