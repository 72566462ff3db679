"""The face for users: what it refuses, what it copies, and the examples in its documentation and in the README."""

from __future__ import annotations

import doctest
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.sph import fields
from blocksim.kernels.sph.fields import Particles, gradient, interpolate

GOOD: dict[str, Any] = {
    "positions": [[0.0, 0.0], [0.1, 0.0]],
    "mass": [1.0, 2.0],
    "density": 1000.0,
    "smoothing_length": 0.1,
}


def test_example_of_the_documentation_gives_what_it_says() -> None:
    assert doctest.testmod(fields) == (0, 10)


@pytest.mark.parametrize(
    ("name", "bad", "message"),
    [
        ("positions", [[0.0, np.nan], [0.1, 0.0]], "positions: every number must be finite"),
        ("positions", [[0.0, np.inf], [0.1, 0.0]], "positions: every number must be finite"),
        ("positions", [[0.0, 1e31], [0.1, 0.0]], "positions: every number must be finite"),
        ("positions", [0.0, 0.1], "positions: shape"),
        ("positions", [[0.0, 0.1, 0.2]], "positions: shape"),
        ("positions", np.empty((0, 2)), "at least one particle"),
        ("mass", [1.0, np.nan], "mass: every number must be finite"),
        ("mass", [1.0, 0.0], "mass: every number must be above zero"),
        ("mass", [1.0, -1.0], "mass: every number must be above zero"),
        ("mass", [1.0, 1.0, 1.0], "mass: shape"),
        ("density", 0.0, "density: every number must be above zero"),
        ("density", [[1.0, 1.0]], "density: shape"),
        ("smoothing_length", 0.0, "smoothing_length: every number must be above zero"),
        ("smoothing_length", np.nan, "smoothing_length: every number must be finite"),
        ("smoothing_length", 1e-31, "smoothing_length: every number must be above zero"),
        ("kernel", "gaussian", "'gaussian' is unknown; use wendland-c2, cubic-spline, quintic-spline"),
    ],
)
def test_particles_that_make_no_sense_are_refused(name: str, bad: object, message: str) -> None:
    Particles(**GOOD)
    with pytest.raises(ValueError, match=message):
        Particles(**GOOD | {name: bad})


@pytest.mark.parametrize("values", [[1.0], [1.0, np.nan], [[1.0, 2.0]], [1.0, 2.0, 3.0]])
def test_values_that_do_not_fit_are_refused(values: list[float]) -> None:
    particles = Particles(**GOOD)
    with pytest.raises(ValueError, match="values: "):
        interpolate(particles, values, [[0.0, 0.0]])
    with pytest.raises(ValueError, match="values: "):
        gradient(particles, values)


@pytest.mark.parametrize("points", [[0.0, 0.0], [[0.0, np.nan]], [[0.0, 0.0, 0.0]]])
def test_points_that_do_not_fit_are_refused(points: list[float]) -> None:
    with pytest.raises(ValueError, match="points: "):
        interpolate(Particles(**GOOD), 1.0, points)


def test_unknown_forms_are_refused() -> None:
    particles = Particles(**GOOD)
    form: Any = "cubic"
    with pytest.raises(ValueError, match="'cubic' is unknown; use plain, shepard, linear"):
        interpolate(particles, 1.0, [[0.0, 0.0]], form)
    with pytest.raises(ValueError, match="'cubic' is unknown; use plain, symmetric, difference, corrected"):
        gradient(particles, 1.0, form)


@pytest.mark.parametrize("h", [1e-30, 1e-5, 1e30])
@pytest.mark.parametrize(("mass", "density"), [(1e-30, 1e30), (1e30, 1e-30), (1.0, 1.0)])
def test_numbers_at_the_limits_overflow_nowhere(h: float, mass: float, density: float) -> None:
    pair = Particles([[0.0, 0.0], [0.5 * h, 0.0]], mass, density, h)
    assert interpolate(pair, [1e30, 1e30], [[0.1 * h, 0.0]], "linear") == pytest.approx([1e30])
    slopes = gradient(pair, [0.0, 1e30], "corrected") / 1e30 * h
    assert slopes.ravel().tolist() == pytest.approx([2.0, 0.0, 2.0, 0.0])
    assert np.isfinite(gradient(pair, [1e30, 1e30], "symmetric")).all()


ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "blocksim/kernels/README.md").read_text(encoding="utf-8")
EXAMPLE = re.compile(
    r"<!-- sph example -->\n```python\n(.*?)```\n\n```\n(.*?)```\n<!-- end of sph example -->", re.DOTALL
)


def test_example_prints_what_the_readme_says(tmp_path: Path) -> None:
    found = EXAMPLE.search(TEXT)
    assert found is not None
    (tmp_path / "example.py").write_text(found.group(1), encoding="utf-8")
    done = subprocess.run([sys.executable, "example.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == found.group(2)
