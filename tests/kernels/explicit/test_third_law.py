"""A contact law is one line: a copy of the package with a third one has all that the other two have."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import blocksim

PACKAGE = Path(blocksim.__file__).parent
LINE = '        Law("hertz-mindlin",'
THIRD = '        Law("power-1.25", 1.25, lambda depth, radius: depth**0.5 * radius**0.25),\n'

CHECKS = """
import math

from blocksim.kernels.explicit.persistent_forces import TOUCHING, persistent_forces
from blocksim.scenario.document import scenario_from_mapping
from blocksim.scenario.laws import LAWS
from blocksim.verification.scene import HEIGHT, WIDTH, CaseScene, SteppedScene
from blocksim.world.interactions import damping_ratio

LAW = LAWS["power-1.25"]
CONTACT = {"law": LAW.name, "stiffness_scale": 0.01, "max_overlap": 5e-3}
x, y = 0.5 * WIDTH, 0.5 * HEIGHT
SHAPES = {"rectangle": {}, "polygon": {"outline": [[-x, -y], [x, -y], [x, y], [-x, y]]}}
TURNED = math.atan2(WIDTH, HEIGHT)  # the corner below the centre: a central impact


def strike(shape, angle, restitution, on_block):
    # Return the speed with which a block leaves that has come down at 1 m/s, and the residual of its ledger.
    reach = math.hypot(x, y) if angle else y
    below = [{"y": y, "fixed": True, **SHAPES[shape]}] if on_block else []
    height = HEIGHT if on_block else 0.0
    block = {"y": height + reach + 1e-9, "angle": angle, "velocity": [0.0, -1.0], **SHAPES[shape]}
    scene = CaseScene([*below, block], gravity=0.0, restitution=restitution, contact=CONTACT).start()
    steady = 0
    while scene.contact_count or scene.bodies[-1].vy < 0.0:
        scene.to_step(scene.steps + 1)
        if scene.contact_count and scene.steps % 8 == 0:
            steady += is_steady(scene.world)
    return float(scene.bodies[-1].vy), scene.residual(), steady


def is_steady(world):
    # Whether a copy of a world under way takes its contacts as lasting ones.
    from copy import deepcopy
    copied = deepcopy(world)
    pairs = [p for p in range(copied.clock[0].pair_count) if copied.pairs[p].active]
    step = float(copied.controls[0].step)
    found = [persistent_forces(copied, p, step, copied.particles)[0] for p in pairs]
    return all(one == TOUCHING for one in found)


for shape in SHAPES:
    for angle in (0.0, TURNED):
        for on_block in (False, True):
            restitution = 0.9 if on_block == (angle > 0.0) else 0.3
            speed, residual, steady = strike(shape, angle, restitution, on_block)
            assert abs(speed - restitution) < 0.01, (shape, angle, on_block, speed)
            assert residual < 1e-3, (shape, angle, on_block, residual)
            assert steady > 0, (shape, angle, on_block)

stiff, soft = (LAW.greatest_slope(1e9, 2.0, speed, 0.0) for speed in (4.0, 1.0))
assert math.isclose(stiff / soft, 4.0 ** (2.0 * 0.25 / 2.25))  # of d^0.25, d going with v^(2/2.25)
light = [CaseScene([{"y": height}], contact=CONTACT).start().step for height in (0.1, 1.0)]
assert light[1] < light[0]  # harder impacts, smaller steps
tables = {
    "schema": 1, "name": "one", "contact": {"law": LAW.name}, "materials": {"m": {"density": 1e3, "young_modulus": 1e9,
    "poisson_ratio": 0.2}}, "blocks": {"b": {"width": 0.1, "height": 0.1, "length": 0.1, "material": "m"}},
    "bodies": [{"block": "b", "x": 0.0, "y": 0.05}],
}
assert math.isclose(LAWS[scenario_from_mapping(tables).contact.law].compression(1.0, 10.0), 10.0 ** (1.0 / 1.25))
assert math.isclose(damping_ratio(0.5, LAW.name) / damping_ratio(0.5), math.sqrt(2.25 / 2.5))
print("done")
"""


@pytest.mark.usefixtures("compiler")
def test_third_law_rebounds_as_asked_and_keeps_its_energy_on_all_shapes(tmp_path: Path) -> None:
    """In a copy of the package that has one line more; its kernels are the same, and compiled."""
    shutil.copytree(PACKAGE, tmp_path / "blocksim", ignore=shutil.ignore_patterns("__pycache__"))
    laws = tmp_path / "blocksim" / "scenario" / "laws.py"
    text = laws.read_text()
    assert LINE in text
    laws.write_text(text.replace(LINE, THIRD + LINE))
    process = subprocess.run(
        [sys.executable, "-c", CHECKS],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
    )
    assert process.stdout.split() == ["done"]
