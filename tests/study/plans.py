"""Sweeps to sample."""

from typing import Any

from blocksim.scenario import Document, Sweep

RATIO = "contact.shear_stiffness_ratio"
SCALE = "contact.stiffness_scale"
TILT = "ground.tilt"
OVERLAP = "structures.0.overlap"


def sweep_of(document: Document, mode: str, vary: dict[str, Any], **own: object) -> Sweep:
    """Return the checked sweep of a document."""
    table = {"mode": mode, **own, **vary}
    sweep = Document({**document.data, "sweep": table}, document.source, document.folder).build().sweep
    assert sweep is not None
    return sweep
