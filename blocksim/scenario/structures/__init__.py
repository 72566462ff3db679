"""The kinds of structure; a new kind is one file next to this one and one line in `AnyStructure`."""

from typing import Annotated, get_args

from pydantic import Field

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

_Union = Staircase | Stack | BlockWall | Pyramid | Dominoes | Grid | Arch | Column | Voronoi | Rubble | Polygons
AnyStructure = Annotated[_Union, Field(discriminator="kind")]
"""Any structure of a scenario, distinguished by its `kind`."""

KINDS: dict[str, type[Structure]] = {
    word: cls for cls in get_args(_Union) for word in get_args(cls.model_fields["kind"].annotation)
}
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
