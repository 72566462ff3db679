"""Contacts that continue between rectangles: where they are; see persistent_outlines.py for polygons."""

from blocksim.kernels.common.arrays import HALF, Record
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.shapes import corner_offset
from blocksim.kernels.explicit import kinematics
from blocksim.kernels.explicit.models.surface import CONE_TOLERANCE, corner_signs


@kernel
def admits(owner: Record, corner: int, nx: float, ny: float) -> bool:
    """Return True if a corner of `owner` can touch a face of the outward normal (nx, ny); see models/duplicates.py."""
    sx, sy = corner_signs(corner)
    along_x = sx * (nx * owner.cos + ny * owner.sin)
    along_y = sy * (ny * owner.cos - nx * owner.sin)
    return along_x <= CONE_TOLERANCE and along_y <= CONE_TOLERANCE


@kernel
def face_frame(body: Record, face: int) -> tuple[float, float, float, float]:
    """Return the outward normal of a face in world axes, its distance from the centre and half of its length (m)."""
    sign = 1.0 if face < 2 else -1.0
    if face % 2 == 0:
        return sign * body.cos, sign * body.sin, body.half_x, body.half_y
    return -sign * body.sin, sign * body.cos, body.half_y, body.half_x


@kernel
def follow(
    contact: Record, a: Record, b: Record, dx: float, dy: float, motion: kinematics.Motion, step: float, turns: bool
) -> tuple[bool, kinematics.Point]:
    """Check that a contact continues, and where and how.

    It does not where its corner has left or has passed the end of the face, where another face is nearer that it can
    touch, or will be within a few steps. Whether the corner can still touch its face at all changes by turning only,
    slowly, and is checked where `turns` says so.
    """
    slot = contact.slot
    is_own = slot < HALF
    owner = a if is_own else b
    touched = b if is_own else a
    side = 1.0 if is_own else -1.0
    corner = slot % HALF
    ox, oy = corner_offset(owner, corner)
    x = ox + side * dx
    y = oy + side * dy
    nx, ny, half, half_length = face_frame(touched, contact.face)
    depth = half - (x * nx + y * ny)
    along = y * nx - x * ny
    beside = half_length - abs(along)
    goes_on = depth > 0.0 and beside >= 0.0 and (not turns or admits(owner, corner, nx, ny))
    found = kinematics.moving_point(x if is_own else ox, y if is_own else oy, side * nx, side * ny, depth, motion, step)
    if beside < max(depth, kinematics.IMPACT_STEPS * abs(found.closing)):
        other = 1.0 if along > 0.0 else -1.0
        goes_on = goes_on and not admits(owner, corner, -other * ny, other * nx)
    return goes_on, found
