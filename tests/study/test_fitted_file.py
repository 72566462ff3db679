"""The scenario that a calibration writes: the user's own text, with other values."""

from difflib import ndiff
from pathlib import Path

import pytest

from blocksim.scenario import Document, scenario_hash
from blocksim.study.calibrate import scenario_text, toml_value
from tests.golden import Golden

SCENARIOS = Path(__file__).parents[2] / "scenarios"
KINETIC = "friction.block_block.kinetic"
WRITTEN: dict[str, tuple[str, dict[str, object], list[str]]] = {
    "values": ("three_blocks", {KINETIC: 0.2, "contact.restitution": 0.25}, []),
    "bare number": ("three_blocks_nominal", {KINETIC: 0.2, "contact.restitution.block_ground": 0.1}, []),
    "units": ("three_blocks", {"structures.0.overlap": "10.12 mm", "structures.0.left": "1 mm"}, []),
    "new keys": ("three_blocks", {"contact.shear_damping_ratio": 0.3, "ground.tilt": "1 deg", "gravity": 9.8}, []),
    "settings": ("three_blocks", {KINETIC: 0.2}, ["contact.stiffness_scale=0.01", "time.end=1 s"]),
    "value of a list": ("slide", {"bodies.0.velocity.0": "0.61 m/s"}, []),
}


@pytest.mark.parametrize("case", WRITTEN)
def test_values_are_replaced_and_everything_else_stays(tmp_path: Path, golden: Golden, case: str) -> None:
    name, values, settings = WRITTEN[case]
    path, out = SCENARIOS / f"{name}.toml", tmp_path / "scenario.toml"
    document = Document.read(path).with_settings(settings)
    out.write_text(scenario_text(document, values, dict.fromkeys(values, "calibrated"), tmp_path, "by a test"))
    found, expected = Document.read(out).build(), document.with_values(values).build()
    assert scenario_hash(found) == scenario_hash(expected)
    assert found.experiment == expected.experiment
    assert {found.provenance[key] for key in values} == {"calibrated"}
    changed = ndiff(path.read_text().splitlines(), out.read_text().splitlines())
    golden("\n".join(line for line in changed if line[0] in "+-" and "table =" not in line))


def test_text_that_cannot_be_edited_is_written_out_resolved(tmp_path: Path) -> None:
    text = (SCENARIOS / "slide.toml").read_text().replace('velocity = ["0.5 m/s", 0]', "velocity = [\n  0.5,\n  0,\n]")
    document = Document.parse(text, "slide.toml", SCENARIOS)
    values = {"bodies.0.velocity": (0.6, 0.0), "friction.block_ground": 0.3}
    found = scenario_text(document, values, {"friction.block_ground": "calibrated"}, tmp_path, "by a test")
    assert "Resolved by blocksim" in found
    built = Document.parse(found, folder=tmp_path).build()
    assert scenario_hash(built) == scenario_hash(document.with_values(values).build())
    assert built.provenance == {"friction.block_ground": "calibrated"}


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1923, "0.1923"),
        ("10 mm", '"10 mm"'),
        ({"static": 0.3, "a b": (1, 2.5)}, '{ static = 0.3, "a b" = [1, 2.5] }'),
        (True, "true"),
    ],
)
def test_values_are_written_on_one_line(value: object, text: str) -> None:
    assert toml_value(value) == text
