"""Values of --set that cannot be used."""

import pytest

from blocksim.scenario.overrides import UnfitOverrideError, with_value
from tests.golden import Golden
from tests.scenario.conftest import VALID, Overrides, Refusal, edited

CASES = {
    "key without its table": "tilt=0",
    "key in a wrong table": "ground.end=3",
    "key that more resembles another one": "restitution=0.3",
    "no value": "time.end",
    "empty value": "time.end=",
    "no key": "=2",
    "unknown key": "friction.block_blok=0.3",
    "unknown key on the way": "friction.block_blok.static=0.3",
    "unknown block": "blocks.brik.width=1",
    "unknown structure": "structures.1.count=2",
    "structure by name": "structures.tower.count=2",
    "key inside a value": "name.first=a",
    "key that shares most of its letters with a longer one": "contact.stifness=0.01",
    "missing key of a table that the setting begins": "motion.kind=table",
    "bad TOML": "bodies=[{block=",
    "wrong type": "time.end=soon",
    "wrong dimension": "time.end = 5 mm",
    "bare angle": "ground.tilt=3",
    "key inside a table": "contact={restitutoin=0.3}",
    "kinetic above the static friction of the file": "friction.block_block.kinetic=0.4",
    "nested too deeply": "name=" + "[" * 20 + "]" * 20,
    "second statement in a value, which is text": "time.end=1\nname='b'",
}


@pytest.mark.parametrize("setting", CASES.values(), ids=CASES)
def test_settings(refusal: Refusal, golden: Golden, setting: str) -> None:
    code, message = refusal(VALID, [setting])
    assert code == 65
    golden(message)


@pytest.mark.parametrize(
    ("loads", "told"),
    [
        (({"name": "water"}, {"kind": "moment"}), r"loads has no \"watr\", did you mean 'water'\?"),
        ((), r'this scenario has no \[\[loads\]\], so no "watr" among them'),
    ],
)
def test_load_of_another_name_is_told_with_those_there_are(loads: tuple[object, ...], told: str) -> None:
    with pytest.raises(UnfitOverrideError, match=told):
        with_value({"loads": loads} if loads else {}, ("loads", "watr", "magnitude"), 1.0)


MIXED = {
    "those that lead nowhere are told together": (7850, ["time.end", "time.end=2", "name.x=1"]),
    "mistakes of the file come first": (-1, ["time.end=0"]),
    "a setting mends the file": (-1, ["materials.steel.density=1000", "time.end=0"]),
    "the last of two equal keys is blamed": (7850, ["time.end=0", "time.end=-1"]),
    "values from Python are named": (7850, {"time.end": "5 mm"}),
    "keys that a sweep varies are named": (
        7850,
        {"sweep": {"mode": "list", **{f"friction.block_block.{key}": [0.1] for key in ("kinetic", "kinetic_ratio")}}},
    ),
}


@pytest.mark.parametrize(("density", "settings"), MIXED.values(), ids=MIXED)
def test_several_mistakes(refusal: Refusal, golden: Golden, density: int, settings: Overrides) -> None:
    code, message = refusal(edited(("7850", str(density))), settings)
    assert code == 65
    golden(message)
