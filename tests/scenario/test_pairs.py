"""Which key decides what holds between two materials."""

import tomllib
from pathlib import Path

from blocksim.scenario import GROUND, resolve_pair, scenario_from_mapping
from tests.golden import Golden
from tests.scenario.conftest import MATERIAL, data_of

MATERIALS = {"oak": MATERIAL, "steel": MATERIAL, "sand": MATERIAL, "S235.JR": MATERIAL}
QUANTITIES = ("restitution", "normal_stiffness", "shear_stiffness_ratio", "shear_damping_ratio")


def test_the_nearest_key_decides_and_is_named(golden: Golden) -> None:
    told = []
    for name, case in tomllib.loads(Path(__file__).with_name("pairs.toml").read_text()).items():
        made = scenario_from_mapping(data_of(materials=MATERIALS, **case.get("tables", {})))
        pair = resolve_pair(made, case["one"], case.get("other", GROUND), ground=case.get("ground", False))
        values = {"friction": pair.friction.static} | {quantity: getattr(pair, quantity) for quantity in QUANTITIES}
        told.append(f"{name}: {', '.join(f'{key} = {value} ({pair.rules[key]})' for key, value in values.items())}")
    golden("\n".join(told))
