"""What happens over time: stepping, recording, the start, events and probes."""

from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal, get_args

import pydantic
from pydantic import Field

from blocksim.scenario import spelling, units as q
from blocksim.scenario.models.base import Identifier, OneOf, Table, TimeOr, Whole, by_kind, require_one, setting

Scheme = Literal["explicit", "nonsmooth"]
SPRINGS, IMPULSES = map(str, get_args(Scheme))
_WORDS = OneOf(get_args(Scheme))

MOST_SLIPS = 2
"""Most typing errors of a scheme, so that its keys are checked as those of the scheme meant."""
LEAST_TOLERANCE = 1e-12  # of velocities in m/s; sums of impulses are not more exact
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
    scheme: Annotated[Scheme, _WORDS] = setting(
        "time stepping: explicit (springs and dashpots) or nonsmooth (impulses)", "explicit"
    )
    end: q.PositiveTime = setting("simulated time (with actuators, by default: until the last one stops)", 2.0)
    step: Step = setting('time step, or "auto" for the largest safe one', "auto")
    force_step: bool = setting("true to accept a step above the safe limit", default=False)
    stop_at_rest: bool = setting("true to end the run once everything rests", default=True)
    rest_speed: q.PositiveSpeed = setting("largest speed that counts as rest", 1e-4)
    rest_hold: q.NonNegativeTime = setting("time that rest must last", 0.05)

    @property
    def parts(self) -> int:
        """The number of substeps in a step."""
        return int(getattr(self, "substeps", 1))


class Explicit(Time):
    """Springs and dashpots, resolved by small steps."""

    declared_in = "blocksim.simulation.schemes.explicit:EXPLICIT"
    has_systems = True
    has_springs = True
    contacts = "springs"
    models_of_outlines = ("surface",)
    scheme: Annotated[Literal["explicit"], _WORDS] = setting("the scheme of this table", "explicit")
    safety: q.Safety = setting("automatic step as a share of the stability limit, at most 0.1", 0.05)


class Nonsmooth(Time):
    """Impulses between rigid blocks, Newton's restitution and Coulomb's friction; a hundred times longer steps."""

    declared_in = "blocksim.simulation.schemes.nonsmooth:NONSMOOTH"
    has_rigid_contacts = True
    contacts = "rigid contacts"
    models_of_outlines = ("surface",)  # the model is not asked for
    scheme: Annotated[Literal["nonsmooth"], _WORDS] = setting("the scheme of this table")
    substeps: Annotated[int, Whole(1, 1000)] = setting(
        "substeps; contacts are detected once per step and solved in every substep", 4
    )
    velocity_tolerance: Annotated[float, _TOLERANCE] | None = setting(
        "largest change of velocity by one impulse at which a substep counts as solved (default: 1 mm/s, "
        "for a single block, and for up to 99 on supports that move, 0.001 mm/s, from 100 on 100 mm/s)",
        None,
    )
    velocity_sweeps: Annotated[int, Whole(1, 1_000_000)] = setting(
        "maximum number of iterations over all contacts per substep", 1000
    )
    restitution_threshold: q.NonNegativeSpeed = setting("approach speed below which impacts do not rebound", 0.01)


def scheme_of(value: object) -> str:
    """Return the scheme of a [time] table, or the scheme that a misspelt word is nearest to."""
    scheme = value.get("scheme") if isinstance(value, Mapping) else getattr(value, "scheme", None)
    if not isinstance(scheme, str):
        return SPRINGS
    return scheme if scheme in SCHEMES else spelling.nearest(scheme, SCHEMES, most=MOST_SLIPS) or SPRINGS


def _registered(value: object, usual: pydantic.ValidatorFunctionWrapHandler, info: pydantic.ValidationInfo) -> object:
    """Read the table of a scheme that is none of those in the union."""
    scheme = SCHEMES[scheme_of(value)]
    return usual(value) if scheme in (Explicit, Nonsmooth) else scheme.model_validate(value, context=info.context)


AnyTime = pydantic.SerializeAsAny[
    Annotated[
        Annotated[Explicit, pydantic.Tag(SPRINGS)] | Annotated[Nonsmooth, pydantic.Tag(IMPULSES)],
        pydantic.Discriminator(scheme_of),
        pydantic.WrapValidator(_registered),
    ]
]
"""Any stepping, distinguished by its `scheme`."""
SCHEMES: dict[str, type[Time]] = {SPRINGS: Explicit, IMPULSES: Nonsmooth}
"""Class by scheme, as written in a scenario; a scheme of the user's choice is one line more."""


class Output(Table):
    """Recording; it never changes the motion."""

    every: q.PositiveTime = setting("time between recorded frames", 0.001)
    contacts: bool = setting("true to record all contacts and their forces in every frame", default=False)


Release = Literal["at rest", "always"]


NOTHING_HELD = {"hold": "[]", "release": "at rest"}
"""Values of keys of [start] that say nothing, as on the command line."""


class Start(Table):
    """What happens before time zero: nothing, or the scene settles under gravity and the loads of time zero.

    Unless it is said, `blocksim.scenario.motion.settles` decides.
    """

    settle: bool | None = setting(
        "true to bring all to rest before time zero, with the contact forces that hold it (default: true where a free "
        "block is beside soil, and under a pulse at its peak from time zero on; else false)",
        None,
    )
    hold: tuple[str, ...] = setting("names of bodies that are kept still meanwhile and released at time zero", ())

    release: Annotated[Release, OneOf(get_args(Release))] = setting(
        'what is released at time zero: a scene "at rest" only, any other ends the run; or "always", which '
        "records how it falls",
        "at rest",
    )

    def _check(self) -> None:
        given = [name for name, default in NOTHING_HELD.items() if getattr(self, name) not in ((), default)]
        if given and not self.settle:
            names = " and ".join(given)
            without = " ".join(f'--set "start.{name}={NOTHING_HELD[name]}"' for name in given)
            raise q.invalid(
                f"without settle = true there is no use for {names}: add it, or leave out {names} ({without})",
                "settle" if "settle" in self.model_fields_set else given[0],
            )


When = Literal["rest"]
ACTIONS = ("remove", "fix", "free", "unload", "velocity")
Names = tuple[str, ...]


class NewVelocity(Table):
    """Velocity that a body gets; what is not given stays as it is."""

    body: str = setting("name of a free body")
    vx: q.Speed | None = setting("velocity of the centre along x (default: as it is)", None)
    vy: q.Speed | None = setting("velocity of the centre along y (default: as it is)", None)
    spin: q.Spin | None = setting("angular velocity (default: as it is)", None)

    def _check(self) -> None:
        if self.vx is None and self.vy is None and self.spin is None:
            raise q.invalid("give vx, vy or spin")


class Event(Table):
    """One event: when it happens, and all that happens then."""

    at: q.PositiveTime | None = setting("time of the event; give this or when", None)
    when: Annotated[When, OneOf(("rest",))] | None = setting(
        '"rest": once everything rests, instead of the end of the run; give this or at', None
    )
    remove: Names = setting('names of bodies and walls ("wall 1" is the first) that go', ())
    fix: Names = setting("names of bodies that are fixed from then on", ())
    free: Names = setting("names of fixed or driven bodies that are free from then on", ())
    unload: Names = setting("names of loads that end, and of actuators that let go", ())
    velocity: NewVelocity | None = setting("velocity that a body gets", None)

    def _check(self) -> None:
        require_one('give a time, such as at = "0.2 s", or when = "rest"', at=self.at, when=self.when)
        if not any(getattr(self, action) for action in ACTIONS):
            raise q.invalid("nothing happens; give remove, fix, free, unload or velocity")


STEP = "step"
Every = Annotated[float | Literal["step"], q.TIME, TimeOr(STEP, "a time between samples")]


def _two(value: object) -> object:
    if isinstance(value, list | tuple) and len(value) != 2:
        raise q.invalid(f'{len(value)} bodies do not make a joint; two are needed, such as ["1", "2"]')
    return value


class Probe(Table):
    """Something that is recorded over time; it never changes the motion."""

    name: Identifier | None = setting("name in files and pictures (default: kind and number, as in force1)", None)
    every: Every | None = setting('time between samples, or "step" for every step (default: every output time)', None)


class ForceProbe(Probe):
    """Force of contacts on something, its point of application, and the share of friction that it mobilises."""

    kind: Literal["force"] = setting("kind of probe")
    on: str = setting(
        'name of the body that it acts on; or "ground", "wall 1", "walls", or "supports": ground, walls '
        "and fixed bodies (fx is the base shear, -fy the support force)"
    )
    by: str | None = setting("body or support that exerts it (default: all that touch)", None)


class PointProbe(Probe):
    """Motion of a material point of a body, in place and relative to the moving support."""

    kind: Literal["point"] = setting("kind of probe")
    body: str = setting("body that the point belongs to, by name")
    at: tuple[q.Length, q.Length] = setting("the point [x, y] in the body's own axes, from its centre", (0.0, 0.0))


class JointProbe(Probe):
    """Opening and slip of the joint between two faces that lie opposite each other at the start."""

    kind: Literal["joint"] = setting("kind of probe")
    bodies: Annotated[tuple[str, str], pydantic.BeforeValidator(_two)] = setting(
        "two bodies by name; the joint turns with the first"
    )


class ActuatorProbe(Probe):
    """Force, displacement and work of an actuator; every actuator has one of its name, unless another is given."""

    kind: Literal["actuator"] = setting("kind of probe")
    actuator: str = setting("name of the actuator")


class EnergyProbe(Probe):
    """The energies of the ledger."""

    kind: Literal["energy"] = setting("kind of probe")


AnyProbe = Annotated[ForceProbe | PointProbe | JointProbe | ActuatorProbe | EnergyProbe, Field(discriminator="kind")]
"""Any probe, distinguished by its `kind`."""
PROBES: dict[str, type[Probe]] = by_kind(AnyProbe)  # class by kind, as written in a scenario
