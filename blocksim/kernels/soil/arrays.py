"""The arrays of all soils of a scene, with unit and sign of every field; SI units.

`n` particles of one spacing s stand for prisms of s x s and the depth of the scene out of the plane, so that masses,
forces and energies are those of blocks; of the areas that they share out where rows are stretched to fill an outline.
Stresses are positive in tension. Particles are kept in the order of their cells; `number` names them for whoever looks
from outside.

Losses are tallied by groups of particles, in their order, so that the bits of a sum depend on no number of threads.
Four particles in a row, a cluster, share one list of neighbours; see neighbours.py.
"""

from typing import NamedTuple

from blocksim.kernels.common.arrays import Integers, Records, record_type
from blocksim.kernels.common.simd import WIDTH

GROUP = 64  # particles that share one tally, and room for their lists
CLUSTER = WIDTH  # particles that share one list
NEIGHBOURS = 24  # room in lists, a particle; undisturbed soil takes 13, a list of a cluster being of 50

POINT = record_type(
    "x y vx vy "  # m, m/s
    # Pa: stress times kernel correction, what neighbours feel; one cache line with the above. Before it is known for a
    # step, the raw gradient of the velocity, 1/s: dvx/dx, dvx/dy, dvy/dx, dvy/dy
    "pxx pxy pyx pyy"
)
STATE = record_type(
    "sxx syy szz sxy "  # Pa, tension positive
    "plastic "  # -: accumulated plastic shear strain, the integral of (2 e:e)^(1/2) of the plastic rate e
    "opening "  # -: volume strain of the gaps, which carry no stress
    "fx fy "  # N: all forces but gravity in the current evaluation
    "drag_x drag_y",  # N: what artificial viscosity contributes to them
    indices="number "  # as in the scenario
    "first",  # its first touch
    small="count",  # of its touches
    flags="kind",  # which of the soils it is of
)
KIND = record_type(
    "density mass volume "  # kg/m3, kg, m3 of a particle
    "share pitch_x pitch_y "  # -, m, m: volume over that of the first kind; distances along the rows and of the rows
    "lame shear bulk "  # Pa: Lame's first parameter, shear modulus, bulk modulus
    "slope cohesion "  # -, Pa: (J2)^(1/2) = cohesion - slope I1 is the yield surface
    "impedance "  # kg/(m2 s): density times wave speed
    "settling settled",  # 1/s, s: rate of damping at the start, and when it ends
    flags="is_corrected",
)
TOUCH = record_type(
    "spring depth "  # m: shear spring, overlap
    "normal_force shear_force "  # N: pushing apart, resisting slip
    "fx fy",  # N: on the particle
    indices="particle body",
)
HISTORY = record_type(
    "spring depth normal_force shear_force",  # as in TOUCH
    indices="body",
)
TALLY = record_type(
    "plastic viscosity dashpot friction settling ramp "  # J, lost so far; ramp: what the missing weight would have done
    "fastest",  # m/s: highest speed in the current drift
)
CONTROLS = record_type(
    "area volume "  # m2, m3: of a particle of the first kind
    "smoothing reach skin "  # m, m, m: h; support radius; how much farther lists reach
    "travel "  # m: no particle or body has moved farther since the lists were made
    "radius "  # m: of the disc that touches bodies
    "viscosity ramp "  # -, s: factor of artificial viscosity; until when gravity grows
    "left bottom cell "  # m: of the grid
    "least_x most_x least_y most_y",  # m: of all particles, those beyond the grid included
    "columns rows "  # of the grid
    "blocks "  # the first bodies are blocks, the others supports
    "touch_count is_listed is_uniform is_full",  # flags: lists are made; one kind; a list had no room
)


ENERGIES = (
    "kinetic",
    "potential",
    "elastic",  # strain energy of the particles
    "contact",  # in the springs between particles and bodies
    "plastic",
    "viscosity",
    "dashpot",
    "friction",
    "settling",  # lost to damping at the start
    "ramp",  # what the missing part of gravity would have done meanwhile
)
"""J, as `step.measure` writes them; the last six are losses."""


class Soils(NamedTuple):
    """All soils of a scene."""

    points: Records  # (n,) POINT
    states: Records  # (n,) STATE
    kinds: Records  # (k,) KIND, one for each table of the scenario
    interactions: Records  # (k, c) INTERACTION of kinds with contact classes of bodies
    order: Integers  # (n,) uint32, work space of the sorting
    starts: Integers  # (3 n / 2 + 3,) uint32: where cells begin
    lists: Integers  # (groups, GROUP * NEIGHBOURS) uint32: those of the clusters of a group, one after the other
    lengths: Integers  # (n,) uint32: of the lists of all clusters; work space of touches, which are made before
    touches: Records  # (t,) TOUCH, what is near a body, sorted by particle and body
    kept: Records  # (t,) HISTORY, what the touches before the lists are made again leave to the new ones
    by_body: Integers  # (t,) uint32: touches sorted by body
    begins: Integers  # (bodies + 1,) uint32: where those of a body begin
    tallies: Records  # (n / GROUP, rounded up) TALLY
    spare_point: Records  # (1,) POINT, work space
    spare_state: Records  # (1,) STATE
    controls: Records  # (1,) CONTROLS
