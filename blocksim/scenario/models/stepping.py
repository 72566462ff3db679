"""Time stepping and recording."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, get_args

from pydantic import (
    Discriminator,
    Field,
    SerializeAsAny,
    Tag,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import OneOf, Table, TimeOr, Whole
from blocksim.scenario.spelling import nearest

Scheme = Literal["explicit", "nonsmooth"]
SPRINGS, IMPULSES = map(str, get_args(Scheme))
_WORDS = OneOf(get_args(Scheme))

MOST_SLIPS = 2
"""Most typing errors of a scheme, so that its keys are checked as those of the scheme meant."""
MOST_SUBSTEPS = 1000
MOST_SWEEPS = 1_000_000
LEAST_TOLERANCE = 1e-12
"""Of velocities in m/s; sums of impulses are not more exact."""
_TOLERANCE = q.Quantity(q.SPEED, at_least=LEAST_TOLERANCE)


Step = Annotated[float | Literal["auto"], q.TIME, TimeOr("auto", "a time step")]


class Time(Table):
    """End and step, whatever the scheme."""

    declared_in: ClassVar[str]  # module:name of its blocksim.simulation.schemes.Scheme
    has_systems: ClassVar[bool] = False  # whether it advances systems beside blocks and supports
    has_springs: ClassVar[bool] = False  # whether contacts are springs, with a model, a law and a stiffness
    has_rigid_contacts: ClassVar[bool] = False  # whether they are impulses
    contacts: ClassVar[str] = "contacts"  # in words
    models_of_outlines: ClassVar[tuple[str, ...]] = ()  # contact models that know blocks with an outline
    scheme: Annotated[Scheme, _WORDS] = Field(
        default="explicit",
        description="time stepping: explicit (springs and dashpots) or nonsmooth (impulses)",
    )
    end: q.PositiveTime = Field(default=2.0, description="simulated time")
    step: Step = Field(default="auto", description='time step, or "auto" for the largest safe one')
    force_step: bool = Field(default=False, description="true to accept a step above the safe limit")
    stop_at_rest: bool = Field(default=True, description="true to end the run once everything rests")
    rest_speed: q.PositiveSpeed = Field(default=1e-4, description="largest speed that counts as rest")
    rest_hold: q.NonNegativeTime = Field(default=0.05, description="time that rest must last")

    @property
    def parts(self) -> int:
        """The number of substeps in a step."""
        return 1


class Explicit(Time):
    """Springs and dashpots, resolved by small steps."""

    declared_in = "blocksim.simulation.schemes.explicit:EXPLICIT"
    has_systems = True
    has_springs = True
    contacts = "springs"
    models_of_outlines = ("surface",)
    scheme: Annotated[Literal["explicit"], _WORDS] = Field(default="explicit", description="the scheme of this table")
    safety: q.Safety = Field(default=0.05, description="automatic step as a share of the stability limit, at most 0.1")


class Nonsmooth(Time):
    """Impulses between rigid blocks, Newton's restitution and Coulomb's friction; a hundred times longer steps."""

    declared_in = "blocksim.simulation.schemes.nonsmooth:NONSMOOTH"
    has_rigid_contacts = True
    contacts = "rigid contacts"
    models_of_outlines = ("surface",)  # the model is not asked for
    scheme: Annotated[Literal["nonsmooth"], _WORDS] = Field(description="the scheme of this table")
    substeps: Annotated[int, Whole(1, MOST_SUBSTEPS)] = Field(
        default=4, description="substeps; contacts are detected once per step and solved in every substep"
    )
    velocity_tolerance: Annotated[float, _TOLERANCE] | None = Field(
        default=None,
        description="largest change of velocity by one impulse at which a substep counts as solved (default: 1 mm/s, "
        "for a single block, and for up to 99 on supports that move, 0.001 mm/s, from 100 on 100 mm/s)",
    )
    velocity_sweeps: Annotated[int, Whole(1, MOST_SWEEPS)] = Field(
        default=1000, description="maximum number of iterations over all contacts per substep"
    )
    restitution_threshold: q.NonNegativeSpeed = Field(
        default=0.01, description="approach speed below which impacts do not rebound"
    )

    @property
    def parts(self) -> int:
        """The number of substeps in a step."""
        return self.substeps


def scheme_of(value: object) -> str:
    """Return the scheme of a [time] table, or the scheme that a misspelt word is nearest to."""
    scheme = value.get("scheme") if isinstance(value, Mapping) else getattr(value, "scheme", None)
    if not isinstance(scheme, str):
        return SPRINGS
    return scheme if scheme in SCHEMES else nearest(scheme, SCHEMES, most=MOST_SLIPS) or SPRINGS


def _registered(value: object, usual: ValidatorFunctionWrapHandler, info: ValidationInfo) -> object:
    """Read the table of a scheme that is none of those in the union."""
    scheme = SCHEMES[scheme_of(value)]
    return usual(value) if scheme in (Explicit, Nonsmooth) else scheme.model_validate(value, context=info.context)


AnyTime = SerializeAsAny[
    Annotated[
        Annotated[Explicit, Tag(SPRINGS)] | Annotated[Nonsmooth, Tag(IMPULSES)],
        Discriminator(scheme_of),
        WrapValidator(_registered),
    ]
]
"""Any stepping, distinguished by its `scheme`."""
SCHEMES: dict[str, type[Time]] = {SPRINGS: Explicit, IMPULSES: Nonsmooth}
"""Class by scheme, as written in a scenario; a scheme of the user's choice is one line more."""


class Output(Table):
    """Recording; it never changes the motion."""

    every: q.PositiveTime = Field(default=0.001, description="time between recorded frames")
    contacts: bool = Field(default=False, description="true to record all contacts and their forces in every frame")
