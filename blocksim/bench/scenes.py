"""The scenes that are measured, made here so that they need no file, and the steps of the non-smooth scheme."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.scenario.models.stepping import IMPULSES, Nonsmooth

Table = Mapping[str, object]

MATERIAL = {"unit_weight": 26.7e3, "young_modulus": 69e9, "poisson_ratio": 0.3}  # N/m3, Pa, -
SIDES = {"width": 0.032, "height": 0.025, "length": 0.05}  # m, the paper's block
FRICTION = {"block_block": 0.31, "block_ground": 0.38}
OVERLAP = 0.01  # m
RESTITUTION = 0.2
WALL_RESTITUTION = 0.1
PUSH = 1.0  # m/s, of the upper edge of a wall
LOW_COURSES = "height"  # `upright` of the wall that non-smooth engines are compared on: bricks of 32 x 25 mm
SUBSTEPS = 4
UNTIL_SOLVED = int(Nonsmooth.model_fields["velocity_sweeps"].default)


@dataclass(frozen=True)
class Stepping:
    """A step and its parts; each is solved to the default tolerance, or gone through as often as `sweeps` says."""

    step: float  # s
    substeps: int = SUBSTEPS
    sweeps: int = UNTIL_SOLVED

    @property
    def setting(self) -> str:
        """For people."""
        return f"step {1e3 * self.step:g} ms / {self.substeps}"

    @property
    def keys(self) -> dict[str, float]:
        """Its keys of [time], all of them numbers."""
        return {"step": self.step, "substeps": self.substeps, "velocity_sweeps": self.sweeps}

    def time(self, **more: object) -> dict[str, object]:
        """Return the table [time], with more keys."""
        return {"scheme": IMPULSES, **self.keys, **more}


def three_blocks(contact: Table | None = None, time: Table | None = None, friction: Table = FRICTION) -> Scenario:
    """Return the three blocks of scenarios/three_blocks_nominal.toml; more keys of [contact] and [time]."""
    stairs = {"kind": "staircase", "block": "brick", "count": 3, "overlap": OVERLAP}
    more = {"contact": {"restitution": RESTITUTION, **(contact or {})}, "time": {"end": 2.0, **(time or {})}}
    return one_structure("three_blocks", _brick("length"), stairs, {**more, "friction": friction})


def pushed_wall(
    columns: int, rows: int, contact: Table | None = None, time: Table | None = None, *, upright: str = "width"
) -> Scenario:
    """Return a wall in running bond, of the same blocks.

    They lie on their sides of 50 x 25 mm, 32 mm high; with upright "height" on those of 32 x 50 mm, 25 mm high. At the
    start a block at height y moves along x with 1 m/s y / H, H the height of the wall.
    """
    wall = {"kind": "wall", "block": "brick", "columns": columns, "rows": rows, "shear_velocity": PUSH}
    more = {"contact": {"restitution": WALL_RESTITUTION, **(contact or {})}}
    more["time"] = {"end": 1.0, "stop_at_rest": False, **(time or {})}
    return one_structure("pushed_wall", _brick(upright), wall, {**more, "friction": FRICTION})


def one_structure(name: str, blocks: Table, structure: Table, more: Table) -> Scenario:
    """Return the scenario of one structure of aluminium blocks; `more` are other tables."""
    data: dict[str, Any] = {
        "schema": 1,
        "name": name,
        "materials": {"aluminium": MATERIAL},
        "blocks": blocks,
        "structures": [structure],
        "ground": {"material": "aluminium"},
        **more,
    }
    return scenario_from_mapping(data)


def _brick(upright: str) -> Table:
    return {"brick": {**SIDES, "upright": upright, "material": "aluminium"}}
