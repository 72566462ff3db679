"""The kinds of structure; a new kind is one file next to this one and one line in `AnyStructure`."""

from typing import Annotated

from pydantic import Field

from blocksim.scenario.models.base import by_kind
from blocksim.scenario.structures.base import Structure
from blocksim.scenario.structures.cells import Arch, Column, Rubble, Voronoi
from blocksim.scenario.structures.masonry import BlockWall, Dominoes, Grid, Pyramid, Stack, Staircase
from blocksim.scenario.structures.polygons import Polygons

AnyStructure = Annotated[
    Staircase | Stack | BlockWall | Pyramid | Dominoes | Grid | Arch | Column | Voronoi | Rubble | Polygons,
    Field(discriminator="kind"),
]
"""Any structure of a scenario, distinguished by its `kind`."""

KINDS: dict[str, type[Structure]] = by_kind(AnyStructure)  # class by kind, as written in a scenario
