"""The kinds of structure; a new kind is one file next to this one and one line in `AnyStructure`."""

from typing import Annotated

from pydantic import Field

from blocksim.scenario.models.base import by_kind
from blocksim.scenario.structures.arch import Arch
from blocksim.scenario.structures.base import MAX_BLOCKS, Pose, Structure, UnfitError
from blocksim.scenario.structures.column import Column
from blocksim.scenario.structures.dominoes import Dominoes
from blocksim.scenario.structures.grid import Grid
from blocksim.scenario.structures.polygons import Polygons
from blocksim.scenario.structures.pyramid import Pyramid
from blocksim.scenario.structures.rubble import Rubble
from blocksim.scenario.structures.shaped import Shaped
from blocksim.scenario.structures.stack import Stack
from blocksim.scenario.structures.staircase import Staircase
from blocksim.scenario.structures.voronoi import Voronoi
from blocksim.scenario.structures.wall import BlockWall

AnyStructure = Annotated[
    Staircase | Stack | BlockWall | Pyramid | Dominoes | Grid | Arch | Column | Voronoi | Rubble | Polygons,
    Field(discriminator="kind"),
]
"""Any structure of a scenario, distinguished by its `kind`."""

KINDS: dict[str, type[Structure]] = by_kind(AnyStructure)
"""Class by kind, as written in a scenario."""

__all__ = [
    "KINDS",
    "MAX_BLOCKS",
    "AnyStructure",
    "Arch",
    "BlockWall",
    "Column",
    "Dominoes",
    "Grid",
    "Polygons",
    "Pose",
    "Pyramid",
    "Rubble",
    "Shaped",
    "Stack",
    "Staircase",
    "Structure",
    "UnfitError",
    "Voronoi",
]
