"""What statics finds, joint by joint and block by block: forces and their margins, and a mechanism."""

import math
from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel

if TYPE_CHECKING:  # pictures of runs need neither solver nor kernels
    from blocksim.statics.blockwork import Blockwork
    from blocksim.statics.programme import Equilibrium

ALL = 1e-6  # of the friction: what is missing is round-off


class JointForce(BaseModel, frozen=True):
    """What a joint carries: bodies (none is a support), the force on the second one, and where it acts."""

    one: str | None
    other: str | None
    x_m: float
    y_m: float
    compression: float  # N
    shear: float  # N, along the normal turned by +90 degrees
    margin_m: float  # from there to the nearer end of the joint; zero is a hinge
    slides: bool  # shear is all that friction allows
    ends_m: tuple[tuple[float, float], ...]
    normal: tuple[float, float]  # from the first to the second

    @property
    def force(self) -> tuple[float, float]:
        """The force (N) on the second body along x and y."""
        x, y = self.normal
        return self.compression * x - self.shear * y, self.compression * y + self.shear * x


class BlockMotion(BaseModel, frozen=True):
    """How a block moves in a mechanism; the largest way of all is 1 m."""

    block: str
    x_m: float
    y_m: float
    turn_rad: float


def joint_forces(structure: "Blockwork", found: "Equilibrium") -> tuple[JointForce, ...]:
    """Return what all joints carry."""
    assembly = structure.assembly
    names = dict(zip(assembly.blocks, structure.names, strict=True))
    joints = []
    for number, joint in enumerate(assembly.joints):
        own = np.flatnonzero(assembly.joint == number)
        normal, shear = found.normal[own], float(found.shear[own].sum())
        total, points = float(normal.sum()), np.array(joint.points)
        x, y = normal @ points / total if total > 0.0 else points.mean(axis=0)
        share = float(normal[0]) / total if total > 0.0 else 0.5
        joints.append(
            JointForce(
                one=names.get(joint.one),
                other=names.get(joint.other),
                x_m=x,
                y_m=y,
                compression=total,
                shear=shear,
                margin_m=math.dist(joint.points[0], joint.points[-1]) * min(share, 1.0 - share),
                slides=total > 0.0 and abs(shear) >= (1.0 - ALL) * float(structure.friction[own[0]]) * total,
                ends_m=joint.points,
                normal=joint.normal,
            )
        )
    return tuple(joints)


def block_motions(structure: "Blockwork", found: "Equilibrium") -> tuple[BlockMotion, ...]:
    """Return how the blocks move in the mechanism."""
    ways = zip(structure.names, found.mechanism.tolist(), strict=True)
    return tuple(BlockMotion(block=name, x_m=x, y_m=y, turn_rad=turn) for name, (x, y, turn) in ways)
