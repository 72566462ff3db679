"""What the record of a contact says about the step before: stiffness then, and forces that were not spring forces."""

from blocksim.kernels.arrays import Record, Records
from blocksim.kernels.jit import kernel
from blocksim.kernels.laws import elastic_force, tangent_stiffness


@kernel
def share_before(contact: Record, particles: Records | None) -> float:
    """Return the share of stiffness that a contact had; corners (no particles) have all of it."""
    if particles is None:
        return 1.0
    return contact.share


@kernel
def shear_stiffness_before(contact: Record, values: Record, law: int, particles: Records | None) -> float:
    """Return the stiffness (N/m) that the shear spring had."""
    stiffness = values.normal_stiffness * share_before(contact, particles)
    return values.shear_ratio * tangent_stiffness(law, stiffness, contact.depth)


@kernel
def normal_loss(contact: Record, values: Record, law: int, particles: Records | None) -> float:
    """Return the part (N) of the normal force that was dashpot, less what clipping took."""
    stiffness = values.normal_stiffness * share_before(contact, particles)
    return contact.normal_force - elastic_force(law, stiffness, contact.depth)


@kernel
def shear_loss(contact: Record, stiffness: float) -> float:
    """Return the part (N) of the shear force that was not that of the spring of this stiffness (N/m)."""
    return contact.shear_force - stiffness * contact.spring
