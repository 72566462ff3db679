"""Steps and skins that scenes take by themselves, and those by hand that are refused: golden/steps.txt.

Rigid contacts: few blocks take a share of the time of a fall over their smallest side, a whole part of the usual 1 ms;
fast blocks, slopes that friction does not hold, and supports in motion shorten that. Springs: the step goes with the
safety and with the root of mass over stiffness; with Hertz it is shorter for hard impacts, never for another model.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blocksim.bench.harness import pushed_wall, three_blocks
from blocksim.errors import BlocksimError
from blocksim.verification.scene import HEIGHT, WIDTH, scenario_of
from blocksim.world.build import build_world
from blocksim.world.describe import describe
from blocksim.world.nonsmooth import build_nonsmooth
from blocksim.world.step import MOST_STEPS

if TYPE_CHECKING:
    from blocksim.scenario import Scenario
    from tests.golden import Golden

RIGID: dict[str, Any] = {"scheme": "nonsmooth"}
REST = {"y": HEIGHT / 2}
LARGE = {"y": 50 * HEIGHT, "width": 100 * WIDTH, "height": 100 * HEIGHT}
SLOPES = {f"a slope of {tilt}": {"ground": {"tilt": f"{tilt} deg"}} for tilt in (20, 40)}
MU = {"block_block": 0.5, "block_ground": 0.5}
SLIPPERY = {"friction": {"block_block": 0.1, "block_ground": 0.5}, **SLOPES["a slope of 20"]}
PLANK = {"x": 1.0, "y": HEIGHT / 2, "width": 1.0, "fixed": True}
HARMONIC = {"kind": "harmonic", "amplitude": "0.1 mm", "frequency": "100 Hz", "ramp": "50 ms"}
PULSE = {"kind": "pulse", "shape": "half-sine", "amplitude": "5 m/s^2", "duration": "5 ms"}
FAST = {**HARMONIC, "amplitude": "20 mm", "ramp": "1 ms"}  # 21.15 m/s
FALLING = {"y": 0.2, "angle": 0.4}
THROWS: dict[str, dict[str, Any]] = {
    "a fall": FALLING,
    "a throw": {**FALLING, "velocity": [0.0, -20.0]},
    "a higher fall": {**FALLING, "y": 5.0},
    "a spin": {**FALLING, "spin": 500.0},
}
MODELS, LAWS, DENSE = ("surface", "kernel", "particles"), ("linear", "hertz-mindlin"), {"particle_spacing": 5e-4}
SLIVER = [[0.0, 0.0], [1.0, 1.0], [0.98, 1.02]]
THIN = {"y": 1.0, "x": 1.0, "height": 2e-3, "fixed": True}
HIGH = {"y": 0.2}
SOFT = {"stiffness_scale": 1e-4}


def rigid(*bodies: dict[str, Any], time: dict[str, Any] | None = None, **tables: Any) -> Scenario:
    return scenario_of(bodies or [REST], time={**RIGID, **(time or {})}, **tables)


def shaken(motion: dict[str, Any], gravity: float = 0.0, **time: Any) -> Scenario:
    return rigid(time={"end": 0.1, **time}, motion=motion, gravity=gravity)


def springs(*bodies: dict[str, Any], **tables: Any) -> Scenario:
    return scenario_of(bodies or [HIGH], **tables)


def wall(columns: int, rows: int, **time: Any) -> Scenario:
    return pushed_wall(columns, rows, time={**RIGID, **time})


SCENES: dict[str, Scenario] = {
    "a block": rigid(),
    "a block and fixed ones": rigid(REST, *({"x": 0.1 * i, **REST, "fixed": True} for i in range(1, 20))),
    "a large block": rigid(LARGE),
    "three blocks": three_blocks(time=RIGID),
    "a wall": wall(4, 4),
    "a high wall": wall(10, 100),
    "a short end": rigid(time={"end": 1e-5}),
    "a fast block": rigid({**REST, "velocity": [50.0, 0.0]}),
    "a fast sliver, 28 mm wide": rigid({"outline": SLIVER, "y": 2.0, "velocity": [50.0, 0.0]}),
    "a drop from 50 m": rigid({"y": 50.0}),
    "by hand": rigid(time={"step": 1e-4}),
    **{f"{name}, friction holds or not": rigid(time={"end": 100.0}, friction=MU, **SLOPES[name]) for name in SLOPES},
    "a slope, slippery blocks": rigid(time={"end": 100.0}, **SLIPPERY),
    "a slope, slippery blocks, a plank": rigid(REST, PLANK, time={"end": 10.0}, **SLIPPERY),
    **{
        f"a wall, {step} s, {count} substeps": wall(40, 25, step=step, substeps=count)
        for step, count in ((1e-3, 4), (5e-3, 4), (1.5e-3, 1))
    },
    "a wall, forced": wall(40, 25, step=5e-3, force_step=True),
    **{
        f"a throw, {step} s": rigid({**REST, "velocity": [3.0, 0.0]}, time={"step": step})
        for step in (8e-4, 9e-4, 1e-18)
    },
    "shaken": shaken(HARMONIC),
    "a pulse": shaken(PULSE),
    "shaken, falling": shaken(HARMONIC, 9.81),
    **{
        f"{name}, {step} s": shaken(motion, step=step)
        for name, motion in (("shaken", HARMONIC), ("a pulse", PULSE))
        for step in (4e-4, 6e-4)
    },
    "shaken, forced": shaken(HARMONIC, step=6e-4, force_step=True),
    "shaken from a steep ramp on": shaken({**HARMONIC, "ramp": "1 ms"}),
    "shaken fast": shaken(FAST),
    "shaken fast, by hand": shaken(FAST, step=2e-4),
    **{f"a thin skin, {skin} m": rigid(HIGH, contact={"skin": skin}) for skin in (1e-4, 4e-4)},
    "springs": springs(),
    "half the safety": springs(time={"safety": 0.025}),
    "a hundredth of the stiffness": springs(contact={"stiffness_scale": 0.01}),
    "no rebound": springs(contact={"restitution": 0.0}),
    **{f"springs, {step} s": springs(time={"step": step}) for step in (1e-5, 1e-8, 0.5 / MOST_STEPS)},
    "springs, forced": springs(time={"step": 1e-5, "force_step": True}),
    "springs, a short end": springs(time={"end": 1e-9}),
    **{f"{law}, {name}": springs(body, contact={"law": law}) for law in LAWS for name, body in THROWS.items()},
    **{f"{model}, stiff": springs(FALLING, THIN, contact={"model": model, **DENSE}, gravity=0.0) for model in MODELS},
    **{
        f"{model}, 100 m/s at a plate": springs(
            {**FALLING, "velocity": [100.0, 0.0]},
            THIN,
            contact={"model": model, "stiffness_scale": 1e-6, **DENSE},
            gravity=0.0,
        )
        for model in MODELS
    },
    "a long wall is no block": springs(
        walls=[{"from": [2, 0], "to": [2, 0.001]}], ground={"profile": [[0.0, 0.0], [0.01, 0.01], [0.02, 0.0]]}
    ),
    **{f"springs, a skin of {skin} m": springs(contact={**SOFT, "skin": skin}) for skin in (1e-5, 7e-3)},
}


def told(scenario: Scenario) -> str:
    """Return the step and the skin of a scene, and why, or why there is none."""
    is_rigid = scenario.time.scheme == "nonsmooth"
    try:
        world = build_nonsmooth(scenario).world if is_rigid else build_world(scenario)
    except BlocksimError as error:
        return f"{type(error).__name__} ({int(error.exit_code)}): {error}"
    controls, why = world.controls[0], describe(scenario).rigid
    return f"{controls.step:.9g} s, skin {controls.skin:.9g} m{f': {why.why}' if why else ''}"


def test_steps_and_skins_are_those_that_were_read(golden: Golden) -> None:
    golden("\n".join(f"{name}: {told(scenario)}" for name, scenario in SCENES.items()), rules=["digits"])
