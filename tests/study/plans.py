"""Sweeps to sample, and their cases; a block on a slope, of which closed forms are known."""

from typing import Any

from blocksim.scenario import Document, Sweep
from blocksim.study.plan import Cases, cases_of, with_sweep

RATIO = "contact.shear_stiffness_ratio"
SCALE = "contact.stiffness_scale"
TILT = "ground.tilt"
OVERLAP = "structures.0.overlap"
KINETIC = "friction.block_block.kinetic"
MU = "friction.block_ground"

FRICTION = 0.38
SLENDER, SQUAT = (0.02, 0.1), (0.1, 0.05)  # m
TILTED: dict[str, Any] = {TILT: {"from": "5 deg", "to": "40 deg"}}
TILTS: dict[str, Any] = {TILT: ["14 deg", "17 deg", "20 deg", "23 deg", "26 deg"]}
SCATTER: dict[str, Any] = {MU: {"mean": FRICTION, "sd": 0.06}}
SLIDES = "outcome = slid"


def block_on_a_slope(size: tuple[float, float], **time: object) -> dict[str, Any]:
    """Return a block of a size (m) at rest on the ground."""
    width, height = size
    return {
        "schema": 1,
        "name": "slope",
        "materials": {"stone": {"density": 2500, "young_modulus": "30 GPa", "poisson_ratio": 0.2}},
        "blocks": {"b": {"width": width, "height": height, "length": 0.1, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0, "y": 0.5 * height}],
        "friction": {"block_ground": FRICTION},
        "contact": {"restitution": 0},
        "time": {"scheme": "nonsmooth", "end": 1.0, "step": 1e-3, **time},
    }


SLOPE = block_on_a_slope(SQUAT, end=0.5, step=2e-3) | {"output": {"every": 0.05}}


def sweep_of(document: Document, mode: str, vary: dict[str, Any], **own: object) -> Sweep:
    """Return the checked sweep of a document."""
    table = {"mode": mode, **own, **vary}
    return plan_of(Document({**document.data, "sweep": table}, document.source, document.folder))


def plan_of(document: Document) -> Sweep:
    """Return the checked sweep that a document has."""
    sweep = document.build().sweep
    assert sweep is not None
    return sweep


def cases(document: Document, vary: Any = None, mode: str | None = None, **own: Any) -> Cases:
    """Return the cases of the sweep that a document has, with other keys if any."""
    planned = with_sweep(document, vary, mode, **own)
    return cases_of(planned, plan_of(planned))
