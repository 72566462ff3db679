"""What pictures know of ground, walls and fixed bodies, from the scenario that a run folder holds."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.scenario import load_scenario, scenario_from_mapping, scenario_to_toml
from blocksim.view.support import Support, support_of

SCENE: dict[str, object] = {
    "schema": 1,
    "name": "a",
    "materials": {"oak": {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}},
    "blocks": {"brick": {"width": 0.1, "height": 0.1, "length": 0.1, "material": "oak"}},
    "structures": [{"kind": "stack", "block": "brick", "count": 2}],
    "bodies": [{"block": "brick", "x": -1, "y": 2, "fixed": True}],
    "ground": {"tilt": "-10 deg", "profile": [[1, 0], [1, -1], [3, 0]]},
    "walls": [{"from": [2, 2], "to": [2, 3]}],
    "motion": {"kind": "harmonic", "amplitude": 0.01, "frequency": 1, "direction": "90 deg", "ramp": 0.1},
}


def test_the_resolved_scenario_of_a_run_tells_all(tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text(scenario_to_toml(scenario_from_mapping(SCENE)), encoding="utf-8")
    support = support_of(load_scenario(tmp_path / "scenario.toml"))
    assert list(support.fixed) == [False, False, True]
    assert np.array(support.profile).tolist() == [[1, 0], [1, -1], [3, 0]]
    assert [(wall.x0, wall.y0, wall.x1, wall.y1) for wall in support.walls] == [(2, 2, 2, 3)]
    assert np.degrees(support.tilt) == pytest.approx(-10.0)
    assert support.offset(np.array([0.0, 1.25, 1.75])) == pytest.approx(np.array([[0, 0], [0, 0.01], [0, -0.01]]))


def test_a_plain_scenario_has_level_ground_at_rest() -> None:
    plain = {key: value for key, value in SCENE.items() if key not in {"ground", "walls", "motion", "bodies"}}
    support = support_of(scenario_from_mapping(plain))
    assert support == Support(fixed=(False, False), weight=support.weight)
    assert support.weight == pytest.approx(19.62)  # two blocks of one kilogram
    assert support.height(np.array([-1e6, 0.0, 1e6])).tolist() == [0.0, 0.0, 0.0]
    assert support.offset(np.array([0.0, 5.0])).tolist() == [[0.0, 0.0], [0.0, 0.0]]
    assert support.corners().tolist() == []


def test_heights_and_corners_of_a_profile() -> None:
    support = Support(profile=((0.0, 0.2), (1.0, 0.2), (2.0, 0.2), (3.0, 0.0), (4.0, 0.0)))
    assert support.height(np.array([-9.0, 2.5, 9.0])) == pytest.approx([0.2, 0.1, 0.0])
    assert support.corners().tolist() == [[2.0, 0.2], [3.0, 0.0]]
    assert support.line(5.0)[[0, -1]].tolist() == [[-5.0, 0.2], [9.0, 0.0]]
