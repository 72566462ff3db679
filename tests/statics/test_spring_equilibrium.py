"""Equilibrium on springs, found without time: closed forms of one block, a published wall, and steps of time."""

import math
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from blocksim.errors import ExitCode
from blocksim.scenario import Model, Scenario, load_scenario
from blocksim.simulation import trajectory
from blocksim.simulation.rest_state import SettleError, settle
from blocksim.simulation.schemes import ALONE, build, scheme_of
from blocksim.statics import spring_equilibrium
from blocksim.study.criterion import DEFAULT, Stability, read_criterion

SCENARIOS = Path(__file__).parents[2] / "scenarios"
G = 9.81
STONE = {"stone": {"density": 2000.0, "young_modulus": 1e9, "poisson_ratio": 0.2}}
WIDTH, HEIGHT, FLOOR = 0.4, 0.2, 0.05  # m
WEIGHT = WIDTH * HEIGHT * 2000.0 * G  # N
PIECES = 100  # fixed stones below a block, whose springs are those of an elastic bed


class Settled(NamedTuple):
    world: Any
    contacts: trajectory.Rows
    steps: int

    @property
    def places(self) -> Any:
        return np.stack([self.world.bodies[name][:-1] for name in ("x", "y", "angle")])


def settled(scenario: Scenario) -> Settled:
    model = Model(scenario)
    scene, found = settle(build(model), model, ALONE)
    contacts = scheme_of(scene).contacts(scene, len(model.bodies))
    return Settled(scene.world, contacts, found.steps)


def holds(scenario: Scenario) -> bool:
    """Return True if a scene comes to rest, False where that is ruled out without time."""
    with suppress(SettleError):
        return settled(scenario).steps > 0
    with pytest.raises(SettleError, match="without meeting anything that holds it"):
        settled(scenario)
    return False


def block(**tables: Any) -> Scenario:
    """Return a block on the ground, at a friction of 0.5."""
    whole = {
        "schema": 1,
        "name": "block",
        "materials": STONE,
        "friction": {"block_block": 0.5, "block_ground": 0.5},
        "blocks": {"b": {"width": WIDTH, "height": HEIGHT, "length": 1.0, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.0, "y": HEIGHT / 2, "name": "one"}],
        "time": {"scheme": "explicit", "end": 1.0},
        "start": {"settle": True},
    }
    return load_scenario({**whole, **tables})


def slope(tangent: float, **tables: Any) -> Scenario:
    return block(ground={"tilt": f"{math.atan(tangent)!r} rad"}, **tables)


def test_a_block_on_a_slope_rests_up_to_its_static_friction_and_slides_beyond() -> None:
    assert holds(slope(0.5 - 1e-4))
    assert not holds(slope(0.5 + 1e-3))
    slippery = {"block_block": 0.5, "block_ground": {"static": 0.5, "kinetic": 0.1, "transition_speed": 1e-8}}
    assert settled(slope(0.2, friction=slippery)).steps < 100


def bed(moment: float) -> Scenario:
    """Return the block on fixed stones side by side, with a moment (N m)."""
    width = WIDTH / PIECES
    stones = [
        {"block": "s", "x": width * (k + 0.5) - 0.5 * WIDTH, "y": FLOOR / 2, "fixed": True} for k in range(PIECES)
    ]
    sizes = {"b": (WIDTH, HEIGHT), "s": (width, FLOOR)}
    loads = [{"kind": "moment", "body": "one", "magnitude": f"{moment!r} N m"}] if moment else []
    return block(
        blocks={
            name: {"width": one, "height": other, "length": 1.0, "material": "stone"}
            for name, (one, other) in sizes.items()
        },
        bodies=[{"block": "b", "x": 0.0, "y": FLOOR + HEIGHT / 2, "name": "one"}, *stones],
        friction={"block_block": 5.0, "block_ground": 5.0},
        loads=loads,
    )


@pytest.mark.parametrize(("turn", "share"), [(1.0, 1.0 / 6.0), (4.0, 1.0 / 3.0), (9.0, 0.5 - 1.0 / 9.0)])
def test_a_rigid_block_on_an_elastic_bed_without_tension_turns_by_its_moment(turn: float, share: float) -> None:
    """M = N b/6 at the turn 2 N/(k b^2), from which on an end is free: N b (1/2 - 1/3 (that over the turn)^(1/2))."""
    sink = FLOOR + HEIGHT / 2 - float(settled(bed(0.0)).places[1, 0])
    first = 2.0 * sink / WIDTH  # k = N/(b sink)
    assert settled(bed(share * WEIGHT * WIDTH)).places[2, 0] == pytest.approx(turn * first, rel=5e-3)


def wall(tilt: float, **values: Any) -> Scenario:
    """Return wall 1 of Ferris & Tin-Loi at a tilt (degrees)."""
    springs = {"time.scheme": "explicit", "time.step": "auto", "start.settle": True}
    return load_scenario(SCENARIOS / "tilting_wall.toml", {**springs, "ground.tilt": f"{tilt} deg", **values})


@pytest.mark.parametrize("values", [{}, {"contact": {"law": "hertz-mindlin", "contact_radius": "50 mm"}}])
def test_all_blocks_of_a_wall_are_in_equilibrium_and_no_joint_pulls_or_holds_more_than_friction(
    values: dict[str, Any],
) -> None:
    found = settled(wall(30.0, **values))
    rows, bodies = found.contacts, found.world.bodies[:-1]
    assert found.steps < 100
    total = np.zeros((len(bodies) + 1, 3))
    across, along = rows["normal_force"], rows["shear_force"]
    fx = across * rows["normal_x"] - along * rows["normal_y"]
    fy = across * rows["normal_y"] + along * rows["normal_x"]
    for side, sign in (("body_a", 1.0), ("body_b", -1.0)):
        number = rows[side]
        x, y = (np.where(number >= 0, bodies[name][number], 0.0) for name in ("x", "y"))
        force = np.stack([fx, fy, (rows["x"] - x) * fy - (rows["y"] - y) * fx], axis=1)
        np.add.at(total, number, sign * force)
    tilt = math.radians(30.0)
    weight = bodies["mass"] * G
    total[:-1, 0] -= weight * math.sin(tilt)
    total[:-1, 1] -= weight * math.cos(tilt)
    assert np.abs(total[:-1]).max() < 1e-6 * float(weight.max())
    pairs = found.world.pairs[: int(found.world.clock[0].pair_count)]
    springs = found.world.contacts[: len(pairs)][
        np.arange(2) < pairs["active"][:, np.newaxis]
    ]  # all but what shares do
    assert (springs["normal_force"] >= 0.0).all()
    slips = np.abs(springs["shear_force"]) / springs["normal_force"]
    assert slips.max() < 0.65 + 1e-9
    assert np.count_nonzero(slips > 0.65 - 1e-9) > 10


def test_wall_one_of_ferris_and_tin_loi_falls_where_runs_and_bounds_have_it() -> None:
    """32.68 degrees, tan 0.6415: between 0.63982 without dilatancy and 0.64286 with it."""
    assert holds(wall(32.68 * 0.998))
    assert not holds(wall(32.68 * 1.002))


def nothing_is_known(scene: Any, _advance: Any, is_free: Any, *_: float) -> spring_equilibrium.SpringRest:
    return spring_equilibrium.SpringRest(scene, None, np.zeros((3, is_free.size)), np.inf)


def test_it_is_the_state_in_which_growing_loads_come_to_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where vibrations make hardly any joint slip: to a thousandth of the deepest overlap."""
    at_once = settled(wall(20.0))
    monkeypatch.setattr(spring_equilibrium, "equilibrium", nothing_is_known)
    in_parts = settled(wall(20.0))
    assert in_parts.steps > 500 * at_once.steps
    deepest = float(in_parts.contacts["overlap"].max())
    assert np.abs(at_once.places - in_parts.places)[:2].max() < 1e-3 * deepest
    assert len(at_once.contacts) == len(in_parts.contacts)
    overlaps = (np.sort(one.contacts["overlap"]) for one in (at_once, in_parts))
    assert np.abs(np.subtract(*overlaps)).max() < 1e-3 * deepest


def test_a_mechanism_is_told_before_it_has_gone_far(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ring of eight stones, which falls from 17.44 degrees on."""
    monkeypatch.setattr(spring_equilibrium, "equilibrium", nothing_is_known)
    ring = {"kind": "arch", "block": "b", "radius": 0.2, "thickness": 0.03, "embrace": "162 deg", "count": 8}
    falling = block(
        blocks={"b": {"depth": 0.1, "material": "stone"}},
        bodies=[],
        structures=[ring],
        friction={"block_block": 1.0, "block_ground": 1.0},
        contact={"restitution": 0.0, "stiffness_scale": 3.0},
        ground={"tilt": "19 deg"},
    )
    with pytest.raises(SettleError, match=r"block \S+ moves at .* has come 0\.0\d+ mm, after \d+ steps") as caught:
        settled(falling)
    assert caught.value.exit_code == ExitCode.NUMERICAL_FAILURE
    assert read_criterion(DEFAULT).verdict({"status": "failed", "reason": str(caught.value)}) is Stability.FALLS
    assert int(str(caught.value).split()[-2]) < 100_000
