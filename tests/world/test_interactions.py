"""Contact parameters of material pairs; the closed form of the clipped restitution against integration."""

from collections.abc import Mapping
from math import sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp

from blocksim.kernels.common.arrays import INTERACTION, Records
from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.world.interactions import (
    SMALLEST_RESTITUTION,
    ContactClass,
    contact_classes,
    damping_ratio,
    interaction_tables,
    interactions_of,
    restitution_of,
)
from tests.golden import Golden

ALUMINIUM = {"unit_weight": 26.7e3, "young_modulus": 69e9, "poisson_ratio": 0.3}
OAK = {"density": 700.0, "young_modulus": 11e9, "poisson_ratio": 0.4}
SIZES = {"width": 0.032, "height": 0.025, "length": 0.05}


def scenario(ground: Mapping[str, object] | None = None, **tables: Any) -> Scenario:
    """Return blocks of aluminium (two upright differently, so of different depth) and of oak."""
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "pairs",
            "materials": {"aluminium": ALUMINIUM, "oak": OAK},
            "blocks": {
                "paper": {**SIZES, "material": "aluminium", "upright": "length"},
                "flat": {**SIZES, "material": "aluminium"},
                "wooden": {**SIZES, "material": "oak"},
            },
            "bodies": [
                {"block": name, "x": 0.1 * i, "y": 0.1} for i, name in enumerate(("paper", "flat", "wooden", "flat"))
            ],
            "ground": ground or {},
            **tables,
        }
    )


KINETIC = {"static": 0.31, "kinetic": 0.19, "transition_speed": 0.004}
SPECIAL = {"restitution": 0.7, "normal_stiffness": 5e6, "shear_stiffness_ratio": 0.4, "shear_damping_ratio": 0.01}
PLAIN, OAKEN = ({"from": [x, 0.5], "to": [x, 0.0]} for x in (1.0, 2.0))
SCENES: dict[str, dict[str, Any]] = {
    "as materials and defaults say": {},
    "ground of oak": {"ground": {"material": "oak"}},
    "stiffness given, and scaled": {
        "contact": {"normal_stiffness": 1e6, "shear_stiffness_ratio": 0.5, "stiffness_scale": 3.0}
    },
    "friction and restitution of blocks and ground": {
        "friction": {"block_block": KINETIC, "block_ground": 0.38},
        "contact": {"restitution": {"block_block": 0.3, "block_ground": 0.6}},
    },
    "damping of shear given": {"contact": {"shear_damping_ratio": 0.05, "restitution": 0.2}},
    "a pair of its own": {"pairs": {"aluminium": {"oak": {"friction": 0.9, **SPECIAL}}}},
    "a pair with ground of oak": {
        "ground": {"material": "oak"},
        "pairs": {"aluminium": {"oak": {"friction": 0.9}, "ground": {"restitution": 0.5}}},
    },
    "a plain wall is ground": {"walls": [PLAIN]},
    "a wall of oak": {
        "walls": [PLAIN, {**OAKEN, "material": "oak"}],
        "friction": {"block_block": 0.2, "block_ground": 0.5},
    },
    "the law of Hertz": {"contact": {"law": "hertz-mindlin"}},
    "the law of Hertz, edges four times as round": {"contact": {"law": "hertz-mindlin", "contact_radius": 0.004}},
}


def test_parameters_of_all_pairs_are_those_that_were_read(golden: Golden) -> None:
    """Of every pair of contact classes, by name and depth: the ground first, then blocks, then walls."""
    texts = []
    for name, tables in SCENES.items():
        of = scenario(**tables)
        found, table = classes(of), table_of(of)
        assert (table == table.T).all()
        names = [f"{one.material or 'ground'}{' wall' if one.is_wall else ''} {one.depth:g} m" for one in found]
        rows = [
            f"{names[i]} - {names[j]}: " + ", ".join(f"{value:.9g}" for value in table[i, j].tolist())
            for i in range(len(found))
            for j in range(i, len(found))
        ]
        texts.append("\n".join([name, *rows]))
    golden("\n\n".join([", ".join(INTERACTION.names or ()), *texts]))


def classes(of: Scenario) -> tuple[ContactClass, ...]:
    return contact_classes(Model(of))


def table_of(of: Scenario) -> Records:
    table: Records = interaction_tables([interactions_of(of, classes(of))])[0]
    return table


def rebound(ratio: float, exponent: float = 1.0) -> float:
    """Return the speed at which x'' = -x^n - 2 z (n x^(n-1))^(1/2) x' from x = 0, x' = 1 has no force any more.

    In w = x^m, m = (n + 1)/2, the force is smooth: dw/ds = m x', dx'/ds = -(w + 2 z n^(1/2) x'), ds = x^(m-1) dt.
    """

    def force(_: float, state: np.ndarray) -> float:
        return float(state[0] + 2.0 * ratio * sqrt(exponent) * state[1])

    force.terminal, force.direction = True, -1  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda s, state: [0.5 * (exponent + 1.0) * state[1], -force(s, state)],
        (0.0, 500.0),
        [0.0, 1.0],
        events=force,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
    )
    return -float(motion.y_events[0][0][1])


@pytest.mark.parametrize("ratio", [0.01, 0.3, 0.72, 0.999, 1.0, 1.001, 5.3])
def test_closed_form_is_the_rebound_of_a_contact_that_cannot_pull(ratio: float) -> None:
    assert restitution_of(ratio) == pytest.approx(rebound(ratio), abs=1e-8)


@given(e=st.floats(SMALLEST_RESTITUTION, 0.999999))
def test_damping_ratio_is_the_inverse_of_the_restitution(e: float) -> None:
    assert restitution_of(damping_ratio(e)) == pytest.approx(e, abs=1e-12)


@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
def test_limits_are_an_undamped_contact_and_a_rebound_of_less_than_one_percent(law: str) -> None:
    assert restitution_of(0.0) == 1.0
    assert damping_ratio(1.0, law) == 0.0
    assert damping_ratio(0.0, law) == damping_ratio(SMALLEST_RESTITUTION, law)
    assert 0.0 < restitution_of(damping_ratio(0.0)) < 0.01


@pytest.mark.parametrize("e", [SMALLEST_RESTITUTION, 0.1, 0.5, 0.99])
def test_hertzian_contact_rebounds_as_asked(e: float) -> None:
    assert rebound(damping_ratio(e, "hertz-mindlin"), 1.5) == pytest.approx(e, abs=1e-4)


@pytest.mark.parametrize("e", [-1e-9, 1.0000001, float("nan")])
def test_restitution_outside_zero_to_one_is_refused(e: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        damping_ratio(e)
