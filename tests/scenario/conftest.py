"""A small valid scenario to break, and the check that a broken one is refused cleanly."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest

from blocksim.errors import BlocksimError
from blocksim.scenario import load_scenario

SCENARIOS = Path(__file__).parents[2] / "scenarios"

VALID = """\
schema = 1
name = "case"

[materials.steel]
density = 7850
young_modulus = "210 GPa"
poisson_ratio = 0.3

[blocks.brick]
width = "40 mm"
height = "20 mm"
length = "60 mm"
material = "steel"

[[structures]]
kind = "stack"
block = "brick"
count = 3
"""

Overrides = Mapping[str, object] | Sequence[str]
Refusal = Callable[..., tuple[int, str]]


@pytest.fixture
def valid_text() -> str:
    return VALID


@pytest.fixture(params=sorted(SCENARIOS.glob("*.toml")), ids=lambda path: path.stem)
def shipped(request: pytest.FixtureRequest) -> Path:
    """Every scenario file that ships."""
    path: Path = request.param
    return path


@pytest.fixture
def refusal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Refusal:
    """Load a scenario that must be refused: exit code and message. Nothing may be written meanwhile."""
    monkeypatch.chdir(tmp_path)

    def load(text: str | bytes, overrides: Overrides = ()) -> tuple[int, str]:
        Path("bad.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
        before = sorted(tmp_path.rglob("*"))
        with pytest.raises(BlocksimError) as caught:
            load_scenario("bad.toml", overrides)
        assert sorted(tmp_path.rglob("*")) == before, "refusing a scenario left files behind"
        return int(caught.value.exit_code), str(caught.value)

    return load


@pytest.fixture
def refusal_of_edit(refusal: Refusal) -> Refusal:
    """Load the valid scenario with one piece of text replaced (None: something added at the end)."""

    def load(old: str | None, new: str) -> tuple[int, str]:
        if old is None:
            return refusal(VALID + new)
        assert VALID.count(old) == 1
        return refusal(VALID.replace(old, new))

    return load
