"""Values of --set that cannot be used: message in full, caret under the guilty part."""

from collections.abc import Callable

import pytest

Refusal = Callable[..., tuple[int, str]]

CASES = {
    "key without its table": (
        "tilt=0",
        """
--set tilt=0: unknown key, did you mean 'ground.tilt'?
      | tilt=0
      | ^^^^
""",
    ),
    "key in a wrong table": (
        "ground.end=3",
        """
--set ground.end=3: unknown key, did you mean 'time.end'?
      | ground.end=3
      | ^^^^^^^^^^
""",
    ),
    "key that more resembles another one": (
        "restitution=0.3",
        """
--set restitution=0.3: unknown key, did you mean 'contact.restitution'?
      | restitution=0.3
      | ^^^^^^^^^^^
""",
    ),
    "no value": (
        "time.end",
        """
--set time.end: write KEY=VALUE, such as contact.stiffness_scale=0.1
      | time.end
      | ^^^^^^^^
""",
    ),
    "empty value": (
        "time.end=",
        """
--set time.end=: write KEY=VALUE, such as contact.stiffness_scale=0.1
      | time.end=
      | ^^^^^^^^
""",
    ),
    "no key": (
        "=2",
        """
--set =2: write KEY=VALUE with a dotted key, such as contact.stiffness_scale=0.1
      | =2
      | ^
""",
    ),
    "unknown key": (
        "friction.block_blok=0.3",
        """
--set friction.block_blok=0.3: unknown key, did you mean 'block_block'?
      | friction.block_blok=0.3
      | ^^^^^^^^^^^^^^^^^^^
""",
    ),
    "unknown key on the way": (
        "friction.block_blok.static=0.3",
        """
--set friction.block_blok.static=0.3: friction.block_blok: unknown key, did you mean 'block_block'?
      | friction.block_blok.static=0.3
      | ^^^^^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "unknown block": (
        "blocks.brik.width=1",
        """
--set blocks.brik.width=1: blocks has no "brik", did you mean 'brick'?
      | blocks.brik.width=1
      | ^^^^^^^^^^^^^^^^^
""",
    ),
    "unknown structure": (
        "structures.1.count=2",
        """
--set structures.1.count=2: structures is a list of 1, numbered from 0; "1" does not exist
      | structures.1.count=2
      | ^^^^^^^^^^^^^^^^^^
""",
    ),
    "structure by name": (
        "structures.tower.count=2",
        """
--set structures.tower.count=2: structures is a list of 1, numbered from 0; "tower" does not exist
      | structures.tower.count=2
      | ^^^^^^^^^^^^^^^^^^^^^^
""",
    ),
    "key inside a value": (
        "name.first=a",
        """
--set name.first=a: name is "case", not a table
      | name.first=a
      | ^^^^^^^^^^
""",
    ),
    "key that shares most of its letters with a longer one": (
        "contact.stifness=0.01",
        """
--set contact.stifness=0.01: unknown key, did you mean 'stiffness_scale'?
      | contact.stifness=0.01
      | ^^^^^^^^^^^^^^^^
""",
    ),
    "missing key of a table that the setting begins": (
        "motion.kind=table",
        """
--set motion.kind=table: motion.table: this key is missing: CSV table, relative to the scenario file: \
time_s and displacement_m, _mm or acceleration_g, _m_s2
      | motion.kind=table
      | ^^^^^^^^^^^
""",
    ),
    "bad TOML": (
        "bodies=[{block=",
        """
--set bodies=[{block=: [{block= is not a TOML value
      | bodies=[{block=
      | ^^^^^^
""",
    ),
    "wrong type": (
        "time.end=soon",
        """
--set time.end=soon: "soon" is not a time: write a number and a unit, such as "2 s"
      | time.end=soon
      |          ^^^^
""",
    ),
    "wrong dimension": (
        "time.end = 5 mm",
        """
--set time.end = 5 mm: "5 mm" is a length; a time above 0 such as "2 s" is needed
      | time.end = 5 mm
      |            ^^^^
""",
    ),
    "bare angle": (
        "ground.tilt=3",
        """
--set ground.tilt=3: 3 has no unit; write "3 deg" (or "3 rad")
      | ground.tilt=3
      |             ^
""",
    ),
    "key inside a table": (
        "contact={restitutoin=0.3}",
        """
--set contact={restitutoin=0.3}: contact.restitutoin: unknown key, did you mean 'restitution'?
      | contact={restitutoin=0.3}
      |         ^^^^^^^^^^^^^^^^^
""",
    ),
    "kinetic above the static friction of the file": (
        "friction.block_block.kinetic=0.4",
        """
--set friction.block_block.kinetic=0.4: kinetic friction 0.4 is above static friction 0.31
      | friction.block_block.kinetic=0.4
      |                              ^^^
""",
    ),
    "nested too deeply": (
        "name=" + "[" * 20 + "]" * 20,
        f"""
--set name={"[" * 20}{"]" * 20}: nested more than 16 levels deep
      | name={"[" * 20}{"]" * 20}
      | ^^^^
""",
    ),
}


@pytest.mark.parametrize(("setting", "message"), CASES.values(), ids=CASES)
def test_settings(refusal: Refusal, valid_text: str, setting: str, message: str) -> None:
    assert refusal(valid_text, [setting]) == (65, message.strip("\n"))


def test_a_second_statement_in_a_value_is_text(refusal: Refusal, valid_text: str) -> None:
    code, message = refusal(valid_text, ["time.end=1\nname='b'"])
    assert code == 65
    assert message.startswith("--set time.end=1\ufffdname='b': \"1\\nname='b'\" is not a time")


def test_settings_that_lead_nowhere_are_reported_together(refusal: Refusal, valid_text: str) -> None:
    _, message = refusal(valid_text, ["time.end", "time.end=2", "name.x=1"])
    assert [line for line in message.split("\n") if line.startswith("--set")] == [
        "--set time.end: write KEY=VALUE, such as contact.stiffness_scale=0.1",
        '--set name.x=1: name is "case", not a table',
    ]


def test_mistakes_of_the_file_come_before_those_of_settings(refusal: Refusal, valid_text: str) -> None:
    _, message = refusal(valid_text.replace("7850", "-1"), ["time.end=0"])
    heads = [line.split(": ")[0] for line in message.split("\n") if " | " not in line]
    assert heads == ["bad.toml:5", "--set time.end=0"]


def test_a_setting_mends_the_file(refusal: Refusal, valid_text: str) -> None:
    _, message = refusal(valid_text.replace("7850", "-1"), ["materials.steel.density=1000", "time.end=0"])
    assert message.startswith("--set time.end=0: 0 is too small")


def test_the_last_of_two_equal_settings_is_blamed(refusal: Refusal, valid_text: str) -> None:
    _, message = refusal(valid_text, ["time.end=0", "time.end=-1"])
    assert message.startswith("--set time.end=-1: -1 is too small")


def test_values_from_python_are_named(refusal: Refusal, valid_text: str) -> None:
    code, message = refusal(valid_text, {"time.end": "5 mm"})
    assert code == 65
    assert message == (
        'value time.end: "5 mm" is a length; a time above 0 such as "2 s" is needed\n'
        '      | time.end = "5 mm"\n'
        "      |            ^^^^^^"
    )
