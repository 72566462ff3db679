"""All kinds of prescribed motion of the supports."""

from typing import Annotated

from pydantic import Field

from blocksim.scenario.models.base import Table, by_kind
from blocksim.scenario.models.motion import FromTable, Harmonic
from blocksim.scenario.models.pulse import Pulse
from blocksim.scenario.models.record import Record

AnyMotion = Annotated[Harmonic | FromTable | Pulse | Record, Field(discriminator="kind")]
"""Any prescribed motion, distinguished by its `kind`."""
MOTIONS: dict[str, type[Table]] = by_kind(AnyMotion)
"""Class by kind, as written in a scenario."""
TABLED = (FromTable, Record)
"""Those that read a file, named by the key `table`."""
