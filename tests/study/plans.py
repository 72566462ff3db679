"""Sweeps to sample, and their cases."""

from typing import Any

from blocksim.scenario import Document, Sweep
from blocksim.study.plan import Cases, cases_of, with_sweep

RATIO = "contact.shear_stiffness_ratio"
SCALE = "contact.stiffness_scale"
TILT = "ground.tilt"
OVERLAP = "structures.0.overlap"


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
