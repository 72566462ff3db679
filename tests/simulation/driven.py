"""Scenes for tests of driven bodies and events: blocks of the paper on a plate, in either scheme."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blocksim.verification.scene import HEIGHT, scenario_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from blocksim.scenario import Scenario

G = 9.81  # m/s2
FRICTION = 0.4
THICK = 0.02  # m
SCHEMES = ("explicit", "nonsmooth")
SOFT = {"explicit": 1e-4, "nonsmooth": 1.0}  # of the material's stiffness: milliseconds are some hundred steps


def plate(motion: Mapping[str, object] | None = None, *, width: float = 0.3, **keys: Any) -> dict[str, Any]:
    """Return a plate with its upper face at y = 0.1 m, driven, or fixed without a motion."""
    moves = {"fixed": True} if motion is None else {"motion": motion}
    return {"y": 0.1 - THICK / 2, "width": width, "height": THICK, "name": "plate", **moves, **keys}


def block(**keys: Any) -> dict[str, Any]:
    """Return the paper's block on the plate."""
    return {"y": 0.1 + keys.get("height", HEIGHT) / 2, "name": "block", **keys}


def on_plate(scheme: str, bodies: Sequence[Mapping[str, object]], end: float, **tables: Any) -> Scenario:
    """Return a scenario of bodies, without rebounds unless `restitution` is among the tables."""
    time = {"scheme": scheme, "end": end, "stop_at_rest": False, **tables.pop("time", {})}
    return scenario_of(
        bodies,
        contact={"restitution": tables.pop("restitution", 0.0), "stiffness_scale": SOFT[scheme]},
        friction={"block_block": tables.pop("friction", FRICTION), "block_ground": FRICTION},
        time=time,
        **tables,
    )
