"""What the record of a contact says about the step before: stiffness then, and forces that were not spring forces."""

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.explicit.laws import elastic_force, tangent_stiffness


@kernel
def stiffness_before(contact: Record, of_corners: float, values: Record, particles: Records | None) -> float:
    """Return the stiffness that a contact had, in units of `normal_stiffness`; `of_corners` is that of its pair."""
    if particles is None:
        return of_corners
    return values.normal_stiffness * contact.share


@kernel
def shear_stiffness_before(contact: Record, stiffness: float, values: Record, law: int) -> float:
    """Return the stiffness (N/m) that the shear spring of a contact had; `stiffness` as above."""
    return values.shear_ratio * tangent_stiffness(law, stiffness, contact.depth)


@kernel
def normal_loss(contact: Record, stiffness: float, law: int) -> float:
    """Return the part (N) of the normal force that was dashpot, less what clipping took; `stiffness` as above."""
    return contact.normal_force - elastic_force(law, stiffness, contact.depth)


@kernel
def shear_loss(contact: Record, stiffness: float) -> float:
    """Return the part (N) of the shear force that was not that of the spring of this stiffness (N/m)."""
    return contact.shear_force - stiffness * contact.spring
