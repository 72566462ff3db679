"""Short and long forms of friction and restitution; kinetic friction as a part of the static one."""

import math

import pytest

from blocksim.kernels.sph.functions import KERNEL_CODES, support_radius
from blocksim.scenario import Document, scenario_hash, scenario_to_toml
from blocksim.scenario.models.contact import Contact, PairFriction, Restitution

SIDE = "friction.block_block"


def test_forms_of_friction() -> None:
    tan21, tan45 = math.tan(math.radians(21)), math.tan(math.pi / 4)
    slow = {"static": "45 deg", "kinetic": 0.5, "transition_speed": "1 mm/s"}
    for given, expected in (
        (0.31, (0.31, 0.31, 0.005)),
        (0, (0.0, 0.0, 0.005)),
        ("21 deg", (tan21, tan21, 0.005)),
        ({"static": 0.3}, (0.3, 0.3, 0.005)),
        (slow, (tan45, 0.5, 0.001)),
    ):
        pair = PairFriction.model_validate(given)
        assert (pair.static, pair.kinetic, pair.transition_speed) == expected


@pytest.mark.parametrize(
    ("given", "length", "support"),
    [
        ({}, 0.0013, 0.0026),
        ({"particle_spacing": 0.002}, 0.0026, 0.0052),
        ({"particle_spacing": 0.002, "kernel": "cubic-spline"}, 0.0026, 0.0052),
        ({"particle_spacing": 0.002, "kernel": "quintic-spline"}, 0.0026, 0.0078),
        ({"particle_spacing": 0.002, "smoothing_length": 0.0016}, 0.0016, 0.0032),
    ],
)
def test_smoothing_length_and_reach_of_the_kernel(given: dict[str, object], length: float, support: float) -> None:
    contact = Contact.model_validate({"model": "kernel", **given})
    reach = support_radius(KERNEL_CODES[contact.kernel], contact.resolved_smoothing_length)
    assert [contact.resolved_smoothing_length, reach] == pytest.approx([length, support])


def test_a_short_smoothing_length_only_matters_to_the_kernel() -> None:
    for model in ("surface", "particles"):
        assert Contact.model_validate({"model": model, "smoothing_length": 1e-6}).smoothing_length == 1e-6


def test_forms_of_restitution() -> None:
    for given, expected in ((0.5, (0.5, 0.5)), (1, (1.0, 1.0)), ({"block_ground": 0.1}, (0.2, 0.1)), ({}, (0.2, 0.2))):
        restitution = Restitution.model_validate(given)
        assert (restitution.block_block, restitution.block_ground) == expected


@pytest.fixture
def document(valid_text: str) -> Document:
    return Document.parse(valid_text)


@pytest.mark.parametrize(
    ("values", "kinetic"),
    [
        ({SIDE: {"static": "45 deg", "kinetic_ratio": 1}}, 1.0),
        ({SIDE: 0.5, f"{SIDE}.kinetic_ratio": 0.25}, 0.125),
        ({SIDE: {"static": 0.5, "kinetic": 0.4}, f"{SIDE}.kinetic_ratio": 0.25}, 0.125),
        ({SIDE: {"static": 0.5, "kinetic_ratio": 0.25}, f"{SIDE}.kinetic": 0.3}, 0.3),
        ({SIDE: {"static": 0.5, "kinetic_ratio": 0.25}, f"{SIDE}.static": 0.4}, 0.1),
    ],
)
def test_kinetic_is_the_ratio_times_static_unless_set_last(
    document: Document, values: dict[str, object], kinetic: float
) -> None:
    assert document.with_values(values).build().friction.block_block.kinetic == pytest.approx(kinetic)


def test_a_resolved_ratio_is_the_same_scenario_and_the_same_run_as_its_value(document: Document) -> None:
    by_ratio = document.with_values({SIDE: {"static": 0.31, "kinetic_ratio": 0.62}}).build()
    by_value = document.with_values({SIDE: {"static": 0.31, "kinetic": 0.31 * 0.62}}).build()
    assert Document.parse(scenario_to_toml(by_ratio)).build() == by_ratio
    assert scenario_hash(by_ratio) == scenario_hash(by_value)
