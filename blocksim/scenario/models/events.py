"""What happens to bodies, walls and loads during a run, at a time or once everything rests."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table, require_one

When = Literal["rest"]
ACTIONS = ("remove", "fix", "free", "unload", "velocity")
Names = tuple[str, ...]


class NewVelocity(Table):
    """Velocity that a body gets; what is not given stays as it is."""

    body: str = Field(description="name of a free body")
    vx: q.Speed | None = Field(default=None, description="velocity of the centre along x (default: as it is)")
    vy: q.Speed | None = Field(default=None, description="velocity of the centre along y (default: as it is)")
    spin: q.Spin | None = Field(default=None, description="angular velocity (default: as it is)")

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if self.vx is None and self.vy is None and self.spin is None:
            raise q.invalid("give vx, vy or spin")
        return self


class Event(Table):
    """One event: when it happens, and all that happens then."""

    at: q.PositiveTime | None = Field(default=None, description="time of the event; give this or when")
    when: Annotated[When, OneOf(("rest",))] | None = Field(
        default=None, description='"rest": once everything rests, instead of the end of the run; give this or at'
    )
    remove: Names = Field(default=(), description='names of bodies and walls ("wall 1" is the first) that go')
    fix: Names = Field(default=(), description="names of bodies that are fixed from then on")
    free: Names = Field(default=(), description="names of fixed or driven bodies that are free from then on")
    unload: Names = Field(default=(), description="names of loads that end")
    velocity: NewVelocity | None = Field(default=None, description="velocity that a body gets")

    @model_validator(mode="after")
    def _has_one_moment_and_an_effect(self) -> Self:
        require_one('give a time, such as at = "0.2 s", or when = "rest"', at=self.at, when=self.when)
        if not any(getattr(self, action) for action in ACTIONS):
            raise q.invalid("nothing happens; give remove, fix, free, unload or velocity")
        return self
