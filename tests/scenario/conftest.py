"""A small valid scenario to break, and the check that a broken one is refused cleanly."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from blocksim.errors import BlocksimError
from blocksim.scenario import load_scenario
from tests.golden import Golden

SCENARIOS = Path(__file__).parents[2] / "scenarios"

VALID = (Path(__file__).parent / "valid" / "scenario.toml").read_text()
MATERIAL = {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}
BRICK: dict[str, Any] = {"width": 0.2, "height": 0.1, "length": 0.1, "material": "oak"}

Overrides = Mapping[str, object] | Sequence[str]
Refusal = Callable[..., tuple[int, str]]
Edit = str | tuple[str, str]  # a whole scenario, what is added to the valid one, or a piece of it and what replaces it
Refused = Callable[..., None]


def data_of(**tables: object) -> dict[str, Any]:
    """Return the data of a scenario of one brick on the ground, with other tables."""
    return {
        "schema": 1,
        "name": "a",
        "materials": {"oak": MATERIAL},
        "blocks": {"brick": BRICK},
        "bodies": [{"block": "brick", "x": 0, "y": 0.05}],
        **tables,
    }


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


def edited(edit: Edit, valid: str = VALID) -> str:
    """Return a valid scenario with an edit."""
    if isinstance(edit, str):
        return f"{edit}\n" if edit.startswith("schema = ") else f"{valid.rstrip()}\n\n{edit}\n"
    valid = f"{valid.rstrip()}\n"
    assert valid.count(edit[0]) == 1
    return valid.replace(*edit)


def read(text: str) -> Edit:
    """Return the edit that a section of a file stands for: what is added, or what it loses (-) and gets instead (+)."""
    if text[0] != "-":
        return text
    gone, here = ("".join(f"{line[1:]}\n" for line in text.split("\n") if line[0] == sign) for sign in "-+")
    return gone, here


@pytest.fixture
def refused(refusal: Refusal, golden: Golden) -> Refused:
    """Load a valid scenario with an edit: it must be refused with the message of the golden file and exit code 65."""

    def check(edit: Edit, valid: str = VALID) -> None:
        code, message = refusal(edited(edit, valid))
        assert code == 65
        golden(message)

    return check
