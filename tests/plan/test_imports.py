"""Imports point downwards also where a module is named by a string, which import-linter does not see."""

import ast
import re
import tomllib
from pathlib import Path

from tests.plan.figures import read_package

CONTRACTS = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
LEVELS = {room.strip(): level for level, rooms in enumerate(CONTRACTS[0]["layers"]) for room in rooms.split("|")}
DECLARED = {  # a table of a scenario says where what it declares is, as one of another package does
    "scenario/models/soil.py": "blocksim.world.systems.soils:SOILS",
    "scenario/models/timeline.py": "blocksim.simulation.schemes.",
}


def test_no_string_names_a_module_of_a_room_above() -> None:
    found = []
    for module in read_package():
        room = module.path.removesuffix(".py").split("/")[0]
        texts = (one.value for one in module.nodes if isinstance(one, ast.Constant) and isinstance(one.value, str))
        for text in texts:
            named = re.fullmatch(r"blocksim\.(\w+)[\w.]*(:\w+)?", text)
            above = named is not None and room in LEVELS and LEVELS[named[1]] < LEVELS[room]
            if above and not text.startswith(DECLARED.get(module.path, "no module")):
                found.append(f"{module.path}: {text}")
    assert found == []
