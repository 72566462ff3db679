"""Friction, restitution and stiffness of two materials, and the keys that set them.

Each quantity is set by the first of these keys that is given:

  between two blocks         pairs.A.B, in either order; then friction.block_block, contact.restitution.block_block
  on the ground              pairs.A.ground; then pairs.A.M, where the ground names its material M; then block_ground
  on a wall of material W    pairs.A.W; then pairs.A.ground; then block_ground

and contact.normal_stiffness, contact.shear_stiffness_ratio and contact.shear_damping_ratio where no pair has its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from blocksim.scenario.keys import format_key
from blocksim.scenario.models.contact import GROUND, Pair, PairFriction
from blocksim.scenario.models.scenario import Scenario

DEFAULT = "default"
MATERIALS = "materials"


@dataclass(frozen=True)
class ResolvedPair:
    """Contact parameters of two materials, SI; None where they follow from the materials, or from normal damping.

    `normal_stiffness` is as given, not yet times contact.stiffness_scale. `rules` has for every field the key that
    set it, "default" where none is given, "materials" where it follows from Young's moduli and Poisson's ratios.
    """

    friction: PairFriction
    restitution: float
    normal_stiffness: float | None
    shear_stiffness_ratio: float | None
    shear_damping_ratio: float | None
    rules: Mapping[str, str]


def resolve_pair(scenario: Scenario, one: str, other: str, *, ground: bool) -> ResolvedPair:
    """Return the contact parameters of the materials `one` and `other`, of two blocks unless `ground`.

    With `ground`, `one` is a block's material and `other` is "ground" or the material that a wall names; a wall
    without a material is as the ground.
    """
    partners = [(one, other)]  # whose tables apply, in order of precedence
    if ground and other != GROUND:
        partners.append((one, GROUND))
    elif ground and scenario.ground.material is not None:
        partners.append((one, scenario.ground.material))
    overrides: list[tuple[str, Pair]] = []
    for names in partners:
        for left, right in dict.fromkeys([names, names[::-1]]):
            pair = scenario.pairs.get(left, {}).get(right)
            if pair is not None:
                overrides.append((format_key(("pairs", left, right)), pair))
    side = "block_ground" if ground else "block_block"
    contact = scenario.contact
    general: dict[str, tuple[object, str]] = {}
    for name, table, place in (
        ("friction", scenario.friction, "friction"),
        ("restitution", contact.restitution, "contact.restitution"),
    ):
        general[name] = getattr(table, side), f"{place}.{side}" if side in table.model_fields_set else DEFAULT
    for name in ("normal_stiffness", "shear_stiffness_ratio", "shear_damping_ratio"):
        otherwise = DEFAULT if name == "shear_damping_ratio" else MATERIALS
        value = getattr(contact, name)
        general[name] = value, otherwise if value is None else f"contact.{name}"
    values: dict[str, Any] = {}
    rules: dict[str, str] = {}
    for quantity, usual in general.items():
        special = ((getattr(pair, quantity), f"{key}.{quantity}") for key, pair in overrides)
        values[quantity], rules[quantity] = next((found for found in special if found[0] is not None), usual)
    return ResolvedPair(**values, rules=rules)
