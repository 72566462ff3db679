"""Forces in the joints of a run and mechanisms: which joints press, slide and rock, and their pictures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from blocksim import plot, replace, run
from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, load_scenario
from blocksim.simulation.results import Result
from blocksim.view.mechanism import SLIDES, BracketRun, draw_mechanisms, joints
from blocksim.view.run_data import support_of
from blocksim.view.scene import corners
from blocksim.view.style import BLOCK_COLOURS, INK, MEASURED_COLOUR, Paper
from blocksim.view.thrust import run_joints
from tests.study.plans import SLENDER, SQUAT, block_on_a_slope

STONE = {"density": 2000.0, "young_modulus": 1e10, "poisson_ratio": 0.2}
WEIGHT = 2000.0 * 9.81 * 0.2 * 0.1  # N


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Two blocks on one another, the upper one 50 mm to the right, pushed to the right by a quarter of its weight."""
    push = {"kind": "force", "body": "2", "magnitude": 0.25 * WEIGHT}
    scenario = {
        "schema": 1,
        "name": "stack",
        "gravity": 9.81,
        "materials": {"stone": STONE},
        "blocks": {"b": {"width": 0.2, "height": 0.1, "length": 1.0, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.0, "y": 0.05}, {"block": "b", "x": 0.05, "y": 0.15}],
        "friction": {"block_block": 0.6, "block_ground": 0.6},
        "loads": [push],
        "start": {"settle": True},
        "time": {"scheme": "nonsmooth", "end": 0.02},
        "output": {"contacts": True},
    }
    return run(scenario, out=tmp_path_factory.mktemp("thrust") / "run")


def test_joints_of_a_run_carry_what_is_above_them_where_moments_put_it(stack: Result) -> None:
    upper, lower = sorted(run_joints(stack.frames, len(stack.frames) - 1), key=lambda one: -one.y_m)
    assert ({upper.one, upper.other}, {lower.one, lower.other}) == ({"1", "2"}, {None, "1"})
    for joint, count in ((upper, 1.0), (lower, 2.0)):
        up = 1.0 if joint.other == max(filter(None, (joint.one, joint.other))) else -1.0  # out of the lower body
        assert joint.normal == pytest.approx((0.0, up), abs=1e-4)
        assert joint.compression == pytest.approx(count * WEIGHT, rel=1e-3)
        assert abs(joint.shear) == pytest.approx(0.25 * WEIGHT, rel=1e-2)
    # moments about the joints: a quarter of the weight 50 and 150 mm above them, weights at 0 and 50 mm
    assert upper.x_m == pytest.approx(0.05 + 0.25 * 0.05, abs=1e-4)
    assert lower.x_m == pytest.approx((0.05 + 0.25 * 0.15) / 2.0, abs=1e-4)
    assert upper.margin_m == pytest.approx(0.1 - upper.x_m, abs=1e-3)  # the joint ends at 100 mm
    assert lower.margin_m == pytest.approx(0.1 - lower.x_m, abs=1e-3)


def test_thrust_of_a_run_is_a_picture_and_needs_contacts(stack: Result, tmp_path: Path) -> None:
    picture = plot(stack, kind="thrust", out=tmp_path / "thrust.png")
    assert picture.read_bytes().startswith(b"\x89PNG")
    bare = run(replace(stack.scenario, {"output.contacts": False}), out=tmp_path / "bare")
    with pytest.raises(InvalidInputError, match="has stored no contacts"):
        plot(bare, kind="thrust", out=tmp_path / "none.png")


def side(size: tuple[float, float], tilt: str, *, contacts: bool = True, **tables: Any) -> BracketRun:
    data: dict[str, Any] = block_on_a_slope(size) | {"ground": {"tilt": tilt}} | tables
    scenario = load_scenario(data | {"output": {"every": 0.02, "contacts": contacts}})
    result = run(scenario)
    assert result.summary.movement is not None
    moved = result.summary.movement.first_mover
    return BracketRun(result.frames, support_of(Model(scenario)), moved, f"at {tilt}", is_mechanism=moved is not None)


@pytest.fixture(scope="module")
def sliding() -> BracketRun:
    """Give a squat block that slides."""
    return side(SQUAT, "25 deg")


@pytest.fixture(scope="module")
def toppling() -> BracketRun:
    """Give a slender block that topples downhill, to -x."""
    return side(SLENDER, "15 deg")


def test_a_sliding_block_has_a_joint_that_slides_and_does_not_rock(sliding: BracketRun) -> None:
    (joint,) = joints(sliding.frames, sliding.frame, sliding.support)
    assert joint.slides
    assert not len(joint.hinges)


def test_a_toppling_block_rocks_about_its_lower_edge(toppling: BracketRun) -> None:
    (joint,) = joints(toppling.frames, toppling.frame, toppling.support)
    assert not joint.slides
    assert joint.hinges == pytest.approx(np.array([[-0.5 * SLENDER[0], 0.0]]), abs=1e-4)


def test_an_arch_placed_without_force_has_its_four_hinges() -> None:
    # Voussoirs on springs touch at the beginning where round-off makes them: at three of eight joints.
    changes = {
        "ground.tilt": "23 deg",  # limit analysis: it falls from 20.49 deg on
        "time": {"scheme": "explicit", "end": 1.6},
        "output": {"every": 0.02, "contacts": True},
    }
    scenario = load_scenario("scenarios/tilting_arch.toml", changes)
    frames = run(scenario).frames
    fallen = BracketRun(frames, support_of(Model(scenario)), "2", "", is_mechanism=True)
    found = joints(frames, fallen.frame, fallen.support)
    assert not any(joint.slides for joint in found)
    hinges = sorted(np.concatenate([joint.hinges for joint in found]).tolist())
    now, then = (1e-3 * np.concatenate(corners(frames, at)[:7]) for at in (fallen.frame, 0))  # of all voussoirs
    nearest = [int(np.argmin(np.hypot(*(now - hinge).T))) for hinge in hinges]
    assert np.array(hinges) == pytest.approx(now[nearest], abs=0.01)
    spring = then[np.argsort(then[:, 1])[:2]]  # the lower corners, of the intrados
    centre = [spring[:, 0].mean(), spring[0, 1] - 9.25 * np.sin(np.radians(11.25))]
    inner, outer = 9.25, 10.75
    assert np.hypot(*(then[nearest] - centre).T) == pytest.approx([outer, inner, outer, inner], abs=0.01)


def test_a_mechanism_is_drawn_when_it_is_first_seen_and_not_as_a_heap(toppling: BracketRun) -> None:
    way = np.hypot(toppling.frames.x - toppling.frames.x[0], toppling.frames.y - toppling.frames.y[0])[:, 0]
    assert way[toppling.frame - 1] <= 0.3 * SLENDER[0] < way[toppling.frame]
    assert toppling.frame < len(way) - 1


def test_the_picture_is_the_same_every_time_and_says_what_each_side_is(
    toppling: BracketRun, sliding: BracketRun, tmp_path: Path
) -> None:
    for name in ("one", "two"):
        draw_mechanisms([(sliding, toppling), (toppling, sliding)], tmp_path / f"{name}.svg", "Both")
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
    with pytest.raises(InvalidInputError, match="too small for this picture"):
        draw_mechanisms([(sliding, toppling)], tmp_path / "small.png", paper=Paper((5.0, 1.0)))
    bare = side(SQUAT, "25 deg", contacts=False)
    with pytest.raises(InvalidInputError, match=r"output\.contacts=true"):
        draw_mechanisms([(bare, toppling)], tmp_path / "bare.png")


def test_no_line_but_a_sliding_joint_reads_as_one_and_the_legend_has_its_colour(
    sliding: BracketRun, toppling: BracketRun, caught: list[Figure]
) -> None:
    draw_mechanisms([(toppling, sliding)], "marks.png")
    (figure,) = caught
    panels = [axes for axes in figure.axes if any(isinstance(one, PolyCollection) for one in axes.collections)]
    assert len(panels) == 2
    lines = [one for axes in panels for one in axes.collections if isinstance(one, LineCollection)]
    above_ground = [line for one in lines for line in one.get_segments() if (np.asarray(line)[:, 1] > 0.0).any()]
    assert above_ground == []  # marks of top faces would lie on joints of voussoirs
    colours = [{line.get_color() for line in axes.lines if line.get_marker() == "D"} for axes in panels]
    assert colours == [set(), {SLIDES}]
    (legend,) = figure.legends
    named = {text.get_text(): handle for text, handle in zip(legend.texts, legend.legend_handles, strict=True)}
    assert list(named) == ["first block to move", "sliding joint", "hinge"]
    assert isinstance(named["sliding joint"], Line2D)
    assert named["sliding joint"].get_color() == SLIDES
    assert SLIDES not in {*BLOCK_COLOURS, MEASURED_COLOUR, INK}


def test_a_block_that_stands_has_no_such_joint() -> None:
    still = side(SQUAT, "5 deg")
    assert joints(still.frames, still.frame, still.support) == []
    assert still.frame == len(still.frames.time) - 1
