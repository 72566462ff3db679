"""The scenario that a calibration writes: the user's own text, with other values."""

from pathlib import Path

import pytest

from blocksim.scenario import Document, scenario_hash
from blocksim.study.calibrate import scenario_text, toml_value

SCENARIOS = Path(__file__).parents[2] / "scenarios"
KINETIC, RESTITUTION = "friction.block_block.kinetic", "contact.restitution"


def written(tmp_path: Path, name: str, values: dict[str, object], *settings: str) -> str:
    """Return the text, after checking that it says what it should."""
    document = Document.read(SCENARIOS / f"{name}.toml").with_settings(settings)
    text = scenario_text(document, values, dict.fromkeys(values, "calibrated"), tmp_path, "by a test")
    (tmp_path / "scenario.toml").write_text(text)
    found, expected = Document.read(tmp_path / "scenario.toml").build(), document.with_values(values).build()
    assert scenario_hash(found) == scenario_hash(expected)
    assert found.experiment == expected.experiment
    assert {found.provenance[key] for key in values} == {"calibrated"}
    return text


def test_values_are_replaced_and_everything_else_stays(tmp_path: Path) -> None:
    text = written(tmp_path, "three_blocks", {KINETIC: 0.2, RESTITUTION: 0.25})
    before = (SCENARIOS / "three_blocks.toml").read_text().splitlines()
    after = text.splitlines()
    assert after[0] == "# by a test"
    changed = [(one, other) for one, other in zip(before, after[1:], strict=True) if one != other]
    assert len(changed) == 5  # two values, two notes of provenance, the path of the table
    comment = "calibrated within the prior 0.17 to 0.31"
    assert changed[0] == (
        f"kinetic = 0.191                     # {comment}",
        f"kinetic = 0.2                       # calibrated, see [provenance]; before: {comment}",
    )
    assert changed[1][1].startswith("restitution = 0.25 ")


def test_bare_number_becomes_the_table_that_it_stands_for(tmp_path: Path) -> None:
    text = written(tmp_path, "three_blocks_nominal", {KINETIC: 0.2, "contact.restitution.block_ground": 0.1})
    assert "block_block = { static = 0.31, kinetic = 0.2 }" in text
    assert "restitution = { block_block = 0.2, block_ground = 0.1 }" in text
    assert "Nothing here is tuned" in text  # comments stay


def test_value_in_a_list_of_tables_keeps_its_unit(tmp_path: Path) -> None:
    text = written(tmp_path, "three_blocks", {"structures.0.overlap": "10.12 mm", "structures.0.left": "1 mm"})
    assert 'overlap = "10.12 mm"' in text
    assert 'left = "1 mm"' in text  # there was none


def test_keys_that_the_file_lacks_are_put_into_their_tables(tmp_path: Path) -> None:
    text = written(
        tmp_path, "three_blocks", {"contact.shear_damping_ratio": 0.3, "ground.tilt": "1 deg", "gravity": 9.8}
    )
    assert "[contact]\nshear_damping_ratio = 0.3\nrestitution" in text
    assert '[ground]\ntilt = "1 deg"' in text
    assert text.splitlines()[1] == "gravity = 9.8"


def test_settings_are_written_too(tmp_path: Path) -> None:
    text = written(tmp_path, "three_blocks", {KINETIC: 0.2}, "contact.stiffness_scale=0.01", "time.end=1 s")
    assert "stiffness_scale = 0.01" in text
    assert 'end = "1 s"' in text


def test_value_of_a_list_is_replaced_in_it(tmp_path: Path) -> None:
    assert 'velocity = ["0.61 m/s", 0]' in written(tmp_path, "slide", {"bodies.0.velocity.0": "0.61 m/s"})


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
