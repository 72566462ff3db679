"""Systems beside the blocks and their supports: which there are, and the table of a scenario that declares each.

A system is one file and one line in `SYSTEMS`: the name of its tables in a scenario, as in [[masses]], and their model.
The file also declares what the system is to all other rooms (blocksim/world/README.md); `declared_in` of the model
says where, as its arrays and kernels are no affair of this room.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import ValidationInfo, create_model

from blocksim.scenario.models.base import Table

if TYPE_CHECKING:
    from blocksim.scenario.models.scenario import Scenario

HELD = "(systems)"
"""Where a scenario keeps the tables of all systems; no key that a file could have."""


class SystemTable(Table):
    """One entry of the tables of a system; every system adds its own keys."""

    declared_in: ClassVar[str]  # module:name of its blocksim.world.systems.system.System

    def impossible(self, scenario: "Scenario") -> Iterator[tuple[str, str]]:  # noqa: ARG002 - for those of systems
        """Yield keys and what is wrong with them, although every value is valid by itself."""
        yield from ()


SYSTEMS: dict[str, type[SystemTable]] = {}
"""Table of a scenario and its model."""


def read_tables(held: Any, info: ValidationInfo) -> dict[str, tuple[SystemTable, ...]]:
    """Return the validated tables of all systems; raises pydantic's error, with their places."""
    several: Any = tuple  # of which type follows at run time
    fields: dict[str, Any] = {name: (several[SYSTEMS[name], ...], ...) for name in held}
    read = create_model("Systems", __base__=Table, **fields).model_validate(held, context=info.context)
    return {name: getattr(read, name) for name in held}
