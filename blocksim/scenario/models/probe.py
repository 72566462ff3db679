"""Probes: time histories of forces, material points, joints and energies, recorded while a run continues."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from blocksim.scenario import quantities as q
from blocksim.scenario.models.base import Identifier, Table, TimeOr, by_kind

STEP = "step"
Every = Annotated[float | Literal["step"], q.TIME, TimeOr(STEP, "a time between samples")]


def _two(value: object) -> object:
    if isinstance(value, list | tuple) and len(value) != 2:
        raise q.invalid(f'{len(value)} bodies do not make a joint; two are needed, such as ["1", "2"]')
    return value


class Probe(Table):
    """Something that is recorded over time; it never changes the motion."""

    name: Identifier | None = Field(
        default=None, description="name in files and pictures (default: kind and number, as in force1)"
    )
    every: Every | None = Field(
        default=None, description='time between samples, or "step" for every step (default: every output time)'
    )


class ForceProbe(Probe):
    """Force of contacts on something, its point of application, and the share of friction that it mobilises."""

    kind: Literal["force"] = Field(description="kind of probe")
    on: str = Field(
        description='name of the body that it acts on; or "ground", "wall 1", "walls", or "supports": ground, walls '
        "and fixed bodies (fx is the base shear, -fy the support force)"
    )
    by: str | None = Field(default=None, description="body or support that exerts it (default: all that touch)")


class PointProbe(Probe):
    """Motion of a material point of a body, in place and relative to the moving support."""

    kind: Literal["point"] = Field(description="kind of probe")
    body: str = Field(description="body that the point belongs to, by name")
    at: tuple[q.Length, q.Length] = Field(
        default=(0.0, 0.0), description="the point [x, y] in the body's own axes, from its centre"
    )


class JointProbe(Probe):
    """Opening and slip of the joint between two faces that lie opposite each other at the start."""

    kind: Literal["joint"] = Field(description="kind of probe")
    bodies: Annotated[tuple[str, str], BeforeValidator(_two)] = Field(
        description="two bodies by name; the joint turns with the first"
    )


class EnergyProbe(Probe):
    """The energies of the ledger."""

    kind: Literal["energy"] = Field(description="kind of probe")


AnyProbe = Annotated[ForceProbe | PointProbe | JointProbe | EnergyProbe, Field(discriminator="kind")]
"""Any probe, distinguished by its `kind`."""
PROBES: dict[str, type[Probe]] = by_kind(AnyProbe)
"""Class by kind, as written in a scenario."""
