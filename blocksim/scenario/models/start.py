"""How a run begins: at once, or after everything has come to rest."""

from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table

Release = Literal["at rest", "always"]


class Start(Table):
    """What happens before time zero: nothing, or the blocks settle under gravity and the loads of time zero.

    They also do under a pulse that begins at its peak at time zero; see `blocksim.scenario.motion.settles`.
    """

    settle: bool = Field(
        default=False, description="true to bring all to rest before time zero, with the contact forces that hold it"
    )
    hold: tuple[str, ...] = Field(
        default=(), description="names of bodies that are kept still meanwhile and released at time zero"
    )

    release: Annotated[Release, OneOf(get_args(Release))] = Field(
        default="at rest",
        description='what is released at time zero: a scene "at rest" only, any other ends the run; or "always", which '
        "records how it falls",
    )

    @model_validator(mode="after")
    def _holds_while_it_settles(self) -> Self:
        if self.hold and not self.settle:
            raise q.invalid("nothing is held without settle = true", "hold")
        if self.release != "at rest" and not self.settle:
            raise q.invalid("all is released at once without settle = true", "release")
        return self
