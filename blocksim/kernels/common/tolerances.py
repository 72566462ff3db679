"""The numbers that kernels compare with. None is a length, a speed or a time.

An entry is a comment, which says what the number does, and a line `NAME = value  # kind | what it is relative to`.

The kinds: round-off (any value between the last digits and what matters would do), smoothing (how wide a transition is
that the model wants without jumps), calibrated (chosen by measurement: results change), cost (time only).
"""

# Common

# Multiple of the transition speed beyond which the static share of friction is below double precision.
FULLY_KINETIC = 40.0  # round-off | transition speed
# Angles up to which a turn is taken from its series.
SMALL_TURN = 1e-2  # round-off | radian
# A piece of ground is a slab of which only the upper face counts. Near a convex joint a point may lie in the end of a
# slab, where the next one bears it; at most so many times deeper below the face than behind the end it still touches.
END_RATIO = 3.0  # calibrated | depth behind the end
# Where cells are too many: places farther from the middle count to the outermost cells.
FAR_OUT = 4.0  # cost | mean distance from the middle
# Places beyond share one cell.
FARTHEST_CELL = 1e9  # cost | cells

# Contacts by springs: shares of stiffness

# Two faces are parallel up to this angle, and their two ends share the stiffness.
FLAT = 0.01  # smoothing | sine of an angle
# A corner touches a face whose normal, reversed, lies between those of the two sides that meet in it (the vertex-face
# pairs of the Minkowski difference of two convex bodies). This tolerance lets both ends of a nearly parallel face
# count, and from there on the corner has all of the stiffness. Of polygons it is the widest. Without this rule the
# corner of an aligned stack, which lies nearer to the side of the block below than to its top, would touch the side.
CONE_TOLERANCE = 0.2  # smoothing | sine of an angle
# Share that a corner keeps which is about to pass the end of a face.
LEAST_SHARE = 1e-6  # round-off | stiffness of a corner
# Change that a pair may miss until it is measured again.
MISSED_STIFFNESS = 0.01  # calibrated | stiffness of the pair
# Normals with a larger cosine are of one face.
SAME_FACE = 0.9  # calibrated | cosine of an angle
# Two corners nearer than that meet in one place.
ONE_PLACE = 8.0  # calibrated | overlap
# A face farther below a corner is not beside it.
BESIDE_SHARE = 0.1  # calibrated | half diagonal
# The corner in contact stays until another is farther in by this. What an end holds changes by twice that times the
# tilt (0.01) as it changes hands, 4e-4 of it; stacks at rest stay flush within less.
HAND_OVER = 0.02  # calibrated | overlap
# How deep a corner under the sharp end of a face may be.
DEEPEST_END = 0.01  # calibrated | half diagonal

# Contacts by springs: slivers

# Overlap on the nearest axis over that on the next one, from where on a pair has its own potential.
SLIVER = 0.1  # calibrated | overlap on the next axis
# Such an overlap over the next one, from where on the second of two tilted ends counts less; at twice that not at all,
# before the faces are no longer parallel.
TILTED = 0.45  # smoothing | cone of the pair
# Corners nearer than that are one end.
ONE_END = 0.5  # smoothing | overlap
# Depth of the second of two faces, at most, where both count as nearest.
AS_NEAR = 1.25  # smoothing | depth of the nearest face
# Power of D1/D with which the weight of an axis falls, as the energy on it rises.
FALLS = 2.0  # smoothing | a power
# What a pair may miss where its contacts are those of bearing.py.
ALIKE = 1e-3  # calibrated | energy of the pair
# What such an overlap holds may be round-off.
NEGLIGIBLE = 1e-6  # round-off | limit of overlap
# The force along the normal never vanishes.
LEAST_FORCE = 0.1  # calibrated | force of a spring of constant stiffness

# Contacts by springs: damping

# Eigenvalues below count as zero: tangents of points on one face are parallel, so that their matrix has rank one up to
# the difference of two overlaps.
DASHPOT_RANK = 1e-4  # round-off | largest eigenvalue
# Jacobi's sweeps: convergence is quadratic, five bring any 3 x 3 matrix to round-off.
EIGEN_SWEEPS = 6  # round-off | sweeps
# Elements beside the diagonal that are as good as none.
EIGEN_ROUND_OFF = 1e-15  # round-off | mean of the diagonal
# How long an operator of two dashpots lasts.
OPERATOR_LIFE = 32  # cost | steps
# Where an overlap changes by no more in a step, operators of other laws than the linear one last.
STEADY = 1e-5  # calibrated | overlap
# How often that is looked for.
STEADY_STEPS = 8  # cost | steps
# Inverse mass that friction leaves.
LEAST_MASS_SHARE = 0.1  # calibrated | inverse mass without friction
# Inertia that a piece of a body keeps.
LEAST_GYRATION = 0.1  # calibrated | square of the radius of gyration
# Steps between two sums over the pieces of a body: where contacts change, where none is coming, and of all bodies.
SHARE_PERIOD = 32  # calibrated | steps
MOST_PERIOD = 128  # cost | steps
SUM_PERIOD = 256  # calibrated | steps
# Bodies that may touch within so many periods count as touching.
APPROACH = 1.5  # calibrated | SHARE_PERIOD
# By so much a new contact may be deeper than its way in one step: a small difference of places over a small product.
CLOSING_ROUND_OFF = 1e-6  # round-off | overlap after one drift
# An impact lasts some thirty steps; a face lost in a third of that cannot stop a corner.
IMPACT_STEPS = 10.0  # calibrated | steps
# After so many the mean of a force over a step and its value in the middle differ by less than 1/30000.
ONSET_STEPS = 16.0  # calibrated | steps

# Contacts by springs: limits of overlap and lists of pairs

# Overlap that ends a run, unless a limit is given.
OVERLAP_SHARE = 0.05  # calibrated | smallest side of the pair
# Overlap beyond which no limit can be: what goes deeper comes out on the other side. Rigid impacts of fast blocks that
# are found late, in steps as long as theirs, go as deep as a tenth and are pushed out again.
MIDDLE = 0.5  # calibrated | smallest side of the pair
# Overlap that ends a run with discs; at 0.35 two rows may rest in the gaps of one another, at 1 their centres meet.
ROWS_APART = 0.75  # calibrated | spacing of particles
# A face deeper than so many times the nearest one is not the one that is touched.
NEAR_RATIO = 4.0  # calibrated | depth of the nearest face
# Two normals oppose one another from here on; at right angles they do not, whatever round-off says.
LEAST_FACING = 1e-9  # round-off | cosine of an angle
# Way by which two bodies may have come nearer since the list was made.
TRAVELLED = 0.8  # cost | skin
# How many times as fast as the fastest one a body may become until the next check.
SPEED_GROWTH = 4.0  # cost | speed
# Way by which two bodies may come nearer in a step.
WAY_SHARE = 0.25  # calibrated | smallest side
# Steps between two looks at the list, and where a support moves: how fast it will, nothing there knows.
MOST_UNSEEN = 1000  # cost | steps
MOST_UNSEEN_DRIVEN = 8  # cost | steps

# Rigid contacts: shapes

# What is farther or faster is not there, or does not count; no place or speed of a scene comes near.
FAR = 1e9  # round-off | metre, metre per second
# By so much a face of body a has to be better than one of body b.
TIE = 6.25e-6  # round-off | least half side of the pair
# Two faces that face each other over less are passed by, up to the angle LEVEL.
EDGE = 0.01  # calibrated | smaller inner radius
LEVEL = 0.1  # calibrated | sine of an angle
# Two points with less between them are one.
ONE_POINT = 1e-5  # round-off | smaller half perimeter of the boxes
# Impulses are kept while the normal turns by no more than 25 degrees.
TURNED = 0.906307787036650  # calibrated | cosine of an angle
# Faces of a block that look more away than that from a segment do not touch its edge.
FACING = -0.01  # calibrated | cosine of an angle
# Faces within 0.01 rad of each other meet as faces, if the end of the segment is no edge.
PARALLEL_COSINE = -0.99995  # calibrated | cosine of an angle
# Steps that a body should be able to continue before its reach is used up.
REACH_STEPS = 16.0  # cost | steps
MOST_MARGIN = 0.5  # cost | least reach of two bodies

# Rigid contacts: impulses

# After so many sweeps shear goes a share of its way, for a coupling from STRONG on: 50 sweeps of less end within a
# millionth.
LATE = 50  # calibrated | sweeps
STRONG = 0.75  # calibrated | coupling
# Bodies whose velocity changes by no more beside a kick touch nothing.
IN_FLIGHT = 1e-9  # round-off | kick
# Normals with a greater share of gravity press at the start of a run.
UPRIGHT = 0.1  # calibrated | cosine of an angle
# Steps cut at impacts: the interval in which an impact falls, and the most cuts of a step.
FINE = 1.0 / 64.0  # calibrated | step
MOST_CUTS = 32  # calibrated | cuts of a step
# Acceleration with which something is held that turns.
MOST_RESTRAINT = 1.5  # calibrated | square of gravity
# What still approaches after so many rounds of impacts does not rebound.
MOST_ROUNDS = 100  # calibrated | rounds
# Tries to find the share of rebounds that keeps the energy; what is left then is made up between the last two.
MOST_TRIES = 30  # round-off | tries
# Impacts are solved to this: what they miss is energy. At least and at most are shares of the restitution threshold.
TOLERANCE_SHARE = 1e-7  # round-off | tolerance of the velocity pass
LEAST_TOLERANCE = 1e-8  # round-off | restitution threshold
MOST_TOLERANCE = 1e-4  # round-off | restitution threshold
# Energy that impacts of a contact group may create: they are solved no better.
IMPACT_ROUND_OFF = 1e-9  # round-off | kinetic energy of the group

# Soil and SPH

# What is nearer to touching a body than this at the start is in contact.
AT_TOUCH = 1e-3  # calibrated | radius of a particle
# Side of the cells that clusters of particles are made from.
CLUSTER_CELL = 2.0  # cost | spacing
# Smallest eigenvalue of M with which a particle is corrected: 1 inside, 0.5 on a flat surface, above 0.1 in a corner.
# What lies beyond is no surface but a few particles that fly.
LEAST_SPREAD = 0.05  # calibrated | inside
# Keeps the viscosity finite where two particles meet.
SOFTENING = 0.01  # smoothing | square of the smoothing length
# Rate -z at which the rows along a face lose its influence, for Wendland's C2 with h = 1.5 spacings.
DECAY = 0.2383014  # round-off | influence on the row before
# Rows nearer than this to where they ought to be stand against a face.
OUT_OF_LINE = 1e-3  # calibrated | spacing
# Eigenvalues below count as zero: of neighbours on a line one is zero up to round-off.
GRADIENT_RANK = 1e-8  # round-off | scale of the matrix
# With numbers up to this, and down to its inverse, no product in a sum overflows or vanishes.
LARGEST = 1e30  # round-off | any unit
