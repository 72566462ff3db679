"""The numbers that kernels compare with. None is a length, a speed or a time, but FAR, which stands for none.

An entry is a comment, which says what the number does, and a line `NAME = value  # kind | what it is relative to`.
The comment ends with the test that notices where the number is ten times as large (x10) or a tenth of it (/10); where
one of them is not named, no test does. `make faults` tries them.

The kinds: round-off (any value between the last digits and what matters would do), smoothing (how wide a transition is
that the model wants without jumps), calibrated (chosen by measurement: results change), cost (time only).
"""

# Common

# Multiple of the transition speed beyond which the static share of friction is below double precision.
# /10: test_friction_falls_exponentially_with_speed_either_way
FULLY_KINETIC = 40.0  # round-off | transition speed
# Angles up to which a turn is taken from its series. x10: test_turn_agrees_with_the_library_on_both_sides_of_the_series
SMALL_TURN = 1e-2  # round-off | radian
# A piece of ground is a slab of which only the upper face counts. Near a convex joint a point may lie in the end of a
# slab, where the next one bears it; at most so many times deeper below the face than behind the end it still touches.
# x10 and /10: test_point_in_the_end_of_a_slab_touches_it_where_it_is_not_much_deeper_than_behind_the_end
END_RATIO = 3.0  # calibrated | depth behind the end
# Where cells are too many: places farther from the middle count to the outermost cells.
FAR_OUT = 4.0  # cost | mean distance from the middle
# Places beyond share one cell.
FARTHEST_CELL = 1e9  # cost | cells

# Contacts by springs: shares of stiffness

# Two faces are parallel up to this angle, and their two ends share the stiffness.
# x10 and /10: test_faces_share_the_stiffness_by_length_while_they_are_parallel
FLAT = 0.01  # smoothing | sine of an angle
# A corner touches a face whose normal, reversed, lies between those of the two sides that meet in it (the vertex-face
# pairs of the Minkowski difference of two convex bodies). This tolerance lets both ends of a nearly parallel face
# count, and from there on the corner has all of the stiffness. Of polygons it is the widest. Without this rule the
# corner of an aligned stack, which lies nearer to the side of the block below than to its top, would touch the side.
# x10 and /10: test_faces_of_blunt_and_sharp_shapes_are_parallel_within_less_than_those_of_rectangles
CONE_TOLERANCE = 0.2  # smoothing | sine of an angle
# Share that a corner keeps which is about to pass the end of a face.
# Nothing notices: a corner with a millionth of the stiffness bears nothing, nor one with ten.
LEAST_SHARE = 1e-6  # round-off | stiffness of a corner
# Change that a pair may miss until it is measured again.
# x10 and /10: test_stiffness_that_changes_fast_is_measured_at_once
MISSED_STIFFNESS = 0.01  # calibrated | stiffness of the pair
# Normals with a larger cosine are of one face. x10: test_stacked_blocks_touch_at_the_top_and_not_at_the_sides
# /10: test_corners_are_one_end_where_their_faces_look_the_same_way
SAME_FACE = 0.9  # calibrated | cosine of an angle
# Two corners nearer than that meet in one place.
# x10 and /10: test_corners_meet_in_one_place_where_they_are_nearer_than_some_overlaps
ONE_PLACE = 8.0  # calibrated | overlap
# A face farther below a corner is not beside it.
# x10 and /10: test_second_face_counts_where_the_corner_is_not_far_below_it
BESIDE_SHARE = 0.1  # calibrated | half diagonal
# The corner in contact stays until another is farther in by this. What an end holds changes by twice that times the
# tilt (0.01) as it changes hands, 4e-4 of it; stacks at rest stay flush within less.
# x10: test_elastic_impact_keeps_its_energy_where_corners_pass_one_another
# /10: test_force_is_the_same_whichever_way_corners_have_passed
HAND_OVER = 0.02  # calibrated | overlap
# How deep a corner under the sharp end of a face may be.
# x10 and /10: test_corner_lies_under_the_sharp_end_of_a_face_where_it_is_not_deep
DEEPEST_END = 0.01  # calibrated | half diagonal

# Contacts by springs: slivers

# Overlap on the nearest axis over that on the next one, from where on a pair has its own potential.
# x10 and /10: test_pair_whose_overlaps_on_two_axes_are_alike_is_a_sliver
SLIVER = 0.1  # calibrated | overlap on the next axis
# Such an overlap over the next one, from where on the second of two tilted ends counts less; at twice that not at all,
# before the faces are no longer parallel.
# x10 and /10: test_second_of_two_tilted_ends_counts_less_before_faces_are_no_longer_parallel
TILTED = 0.45  # smoothing | cone of the pair
# Corners nearer than that are one end.
# x10 and /10: test_corners_of_a_sliver_are_one_end_where_they_are_nearer_than_about_its_overlap
ONE_END = 0.5  # smoothing | overlap
# Depth of the second of two faces, at most, where both count as nearest.
# x10 and /10: test_no_axis_of_a_sliver_is_left_out_that_weighs_something
AS_NEAR = 1.25  # smoothing | depth of the nearest face
# Power of D1/D with which the weight of an axis falls, as the energy on it rises.
# x10 and /10: test_axes_of_a_sliver_weigh_by_about_the_square_of_their_overlaps
FALLS = 2.0  # smoothing | a power
# What a pair may miss where its contacts are those of bearing.py.
# x10 and /10: test_points_are_both_ends_of_an_interval_where_they_hold_as_much
ALIKE = 1e-3  # calibrated | energy of the pair
# What such an overlap holds may be round-off.
# x10 and /10: test_points_are_both_ends_of_an_interval_where_they_hold_as_much
NEGLIGIBLE = 1e-6  # round-off | limit of overlap
# The force along the normal never vanishes.
# x10 and /10: test_force_of_a_sliver_along_its_normal_is_a_tenth_of_that_of_a_spring_at_least
LEAST_FORCE = 0.1  # calibrated | force of a spring of constant stiffness

# Contacts by springs: damping

# Eigenvalues below count as zero: tangents of points on one face are parallel, so that their matrix has rank one up to
# the difference of two overlaps. x10: test_dashpots_of_a_pair_follow_the_definition
DASHPOT_RANK = 1e-4  # round-off | largest eigenvalue
# Jacobi's sweeps: convergence is quadratic, five bring any 3 x 3 matrix to round-off.
# /10: test_power_of_three_agrees_with_eigenvalues
EIGEN_SWEEPS = 6  # round-off | sweeps
# Elements beside the diagonal that are as good as none.
# Nothing notices: another sweep would change no digit that counts.
EIGEN_ROUND_OFF = 1e-15  # round-off | mean of the diagonal
# How long an operator of two dashpots lasts. x10 and /10: test_stiffness_that_changes_fast_is_measured_at_once
OPERATOR_LIFE = 32  # cost | steps
# Where an overlap changes by no more in a step, operators of other laws than the linear one last.
# x10 and /10: test_operator_lasts_while_its_overlap_hardly_changes
STEADY = 1e-5  # calibrated | overlap
# How often that is looked for.
STEADY_STEPS = 8  # cost | steps
# Inverse mass that friction leaves. x10 and /10: test_dashpot_of_a_corner_that_jams_has_a_tenth_of_the_mass
LEAST_MASS_SHARE = 0.1  # calibrated | inverse mass without friction
# Inertia that a piece of a body keeps.
# x10 and /10: test_piece_of_a_body_keeps_a_tenth_of_its_inertia_however_far_its_joint_is
LEAST_GYRATION = 0.1  # calibrated | square of the radius of gyration
# Steps between two sums over the pieces of a body, where contacts change.
# x10 and /10: test_contacts_that_change_all_the_time_have_the_sums_made_every_thirty_steps
SHARE_PERIOD = 32  # calibrated | steps
# The same where none is coming. x10 and /10: test_sums_of_all_bodies_are_made_anew_from_time_to_time
MOST_PERIOD = 128  # cost | steps
# The same of all bodies. x10 and /10: test_sums_of_all_bodies_are_made_anew_from_time_to_time
SUM_PERIOD = 256  # calibrated | steps
# Bodies that may touch within so many periods count as touching.
# x10 and /10: test_bodies_count_as_touching_some_dozen_steps_before
APPROACH = 1.5  # calibrated | SHARE_PERIOD
# By so much a new contact may be deeper than its way in one step: a small difference of places over a small product.
# x10 and /10: test_contact_has_just_begun_where_it_is_no_deeper_than_its_way_in_a_step
CLOSING_ROUND_OFF = 1e-6  # round-off | overlap after one drift
# An impact lasts some thirty steps; a face lost in a third of that cannot stop a corner.
# x10 and /10: test_face_that_a_corner_leaves_within_a_third_of_an_impact_cannot_stop_it
IMPACT_STEPS = 10.0  # calibrated | steps
# After so many the mean of a force over a step and its value in the middle differ by less than 1/30000.
# x10 and /10: test_dashpot_of_hertz_rises_at_the_begin_of_a_contact
ONSET_STEPS = 16.0  # calibrated | steps

# Contacts by springs: limits of overlap and lists of pairs

# Overlap that ends a run, unless a limit is given. x10 and /10: test_smaller_block_of_a_pair_limits_the_overlap
OVERLAP_SHARE = 0.05  # calibrated | smallest side of the pair
# Overlap beyond which no limit can be: what goes deeper comes out on the other side. Rigid impacts of fast blocks that
# are found late, in steps as long as theirs, go as deep as a tenth and are pushed out again.
# x10 and /10: test_overlap_has_a_limit_and_none_is_beyond_the_middle
MIDDLE = 0.5  # calibrated | smallest side of the pair
# Overlap that ends a run with discs; at 0.35 two rows may rest in the gaps of one another, at 1 their centres meet.
# x10 and /10: test_overlap_of_particles_is_less_than_where_centres_of_two_rows_meet_and_more_than_in_their_gaps
ROWS_APART = 0.75  # calibrated | spacing of particles
# A face deeper than so many times the nearest one is not the one that is touched.
# /10: test_face_has_the_stiffness_of_two_corners_at_any_spacing
NEAR_RATIO = 4.0  # calibrated | depth of the nearest face
# Two normals oppose one another from here on; at right angles they do not, whatever round-off says.
# Nothing notices: normals of blocks at right angles are off by 1e-16, and a share of 1e-8 weighs nothing.
LEAST_FACING = 1e-9  # round-off | cosine of an angle
# Way by which two bodies may have come nearer since the list was made.
TRAVELLED = 0.8  # cost | skin
# How many times as fast as the fastest one a body may become until the next check.
SPEED_GROWTH = 4.0  # cost | speed
# Way by which two bodies may come nearer in a step.
# x10 and /10: test_two_bodies_may_not_come_nearer_by_a_good_part_of_a_side_in_a_step
WAY_SHARE = 0.25  # calibrated | smallest side
# Most steps between two looks at the list.
MOST_UNSEEN = 1000  # cost | steps
# The same where a support moves: how fast it will, nothing there knows.
MOST_UNSEEN_DRIVEN = 8  # cost | steps

# Rigid contacts: shapes

# What is farther or faster is not there, or does not count; no place or speed of a scene comes near.
# Nothing notices: no scene is 100 000 km wide.
FAR = 1e9  # round-off | metre, metre per second
# By so much a face of body a has to be better than one of body b.
# x10 and /10: test_face_of_body_a_has_to_be_better_by_a_tie
TIE = 6.25e-6  # round-off | least half side of the pair
# Corners nearer to one another meet, and a third body may show which faces do. Overlaps of a run are less.
# /10: test_step_is_climbed_that_is_no_higher_than_contacts_are_deep_and_blocks_uneven
NEAR_CORNER = 0.1  # cost | smaller inner radius
# Overlaps no deeper than that do not show which faces of two corners meet: times the deepest of what presses them,
# x10 and /10: test_step_is_climbed_that_is_no_higher_than_contacts_are_deep_and_blocks_uneven
SAG = 2.0  # calibrated | deepest overlap
# and beside that, as neighbours sink unequally. A step of that height is climbed.
# x10 and /10: test_step_is_climbed_that_is_no_higher_than_contacts_are_deep_and_blocks_uneven
UNEVEN = 2e-3  # calibrated | smaller inner radius
# Two points with less between them are one. x10 and /10: test_two_points_with_next_to_nothing_between_them_are_one
ONE_POINT = 1e-5  # round-off | smaller half perimeter of the boxes
# Impulses are kept while the normal turns by no more than 25 degrees.
# x10 and /10: test_impulses_are_kept_until_the_normal_has_turned_by_25_degrees
TURNED = 0.906307787036650  # calibrated | cosine of an angle
# Faces of a block that look more away than that from a segment do not touch its edge.
# x10 and /10: test_edge_of_a_step_is_for_faces_that_look_away_from_it
FACING = -0.01  # calibrated | cosine of an angle
# Faces within 0.01 rad of each other meet as faces, if the end of the segment is no edge.
# x10 and /10: test_block_that_reaches_beyond_both_ends_of_a_segment_meets_it_as_faces_while_they_are_parallel
PARALLEL_COSINE = -0.99995  # calibrated | cosine of an angle
# Steps that a body should be able to continue before its reach is used up.
REACH_STEPS = 20.0  # cost | steps
# From one step in which lists that would not last as long are made anew to the next such step.
LIST_STEPS = 8  # cost | steps
# Way that a body may go in a step without a look at the list.
MOST_MARGIN = 0.5  # cost | least reach of two bodies

# Rigid contacts: impulses

# Faces that meet with a smaller angle meet as faces: no brick is flatter, and sag at rest tilts rows by some 1e-9.
# x10 and /10: test_faces_meet_as_faces_up_to_an_angle_that_no_brick_is_flat_to
FLUSH = 1e-5  # calibrated | sine of an angle
# After so many sweeps shear that couples strongly goes a share of its way.
# x10 and /10: test_shear_is_held_back_after_some_dozen_sweeps
LATE = 50  # calibrated | sweeps
# Coupling from which on it does: 50 sweeps of less end within a millionth.
# x10 and /10: test_shear_that_couples_strongly_goes_a_share_of_its_way
STRONG = 0.75  # calibrated | coupling
# Bodies whose velocity changes by no more beside a kick touch nothing.
# x10 and /10: test_body_is_in_flight_where_its_velocity_changes_by_its_kick
IN_FLIGHT = 1e-9  # round-off | kick
# Normals with a greater share of gravity press at the start of a run.
# x10 and /10: test_what_is_not_upright_presses_at_the_start_of_a_run
UPRIGHT = 0.1  # calibrated | cosine of an angle
# Interval in which an impact falls, where steps are cut at impacts.
# x10 and /10: test_interval_of_an_impact_is_a_small_part_of_a_step_and_a_step_has_some_dozens
FINE = 1.0 / 64.0  # calibrated | step
# Most cuts of a step. x10 and /10: test_interval_of_an_impact_is_a_small_part_of_a_step_and_a_step_has_some_dozens
MOST_CUTS = 32  # calibrated | cuts of a step
# Acceleration with which something is held that turns.
# x10 and /10: test_acceleration_of_what_turns_is_known_up_to_about_that_of_gravity
MOST_RESTRAINT = 1.5  # calibrated | square of gravity
# What still approaches after so many rounds of impacts does not rebound. /10: test_long_row_passes_a_blow_on
MOST_ROUNDS = 100  # calibrated | rounds
# Tries to find the share of rebounds that keeps the energy; what is left then is made up between the last two.
# Nothing notices: three are enough in all tests, and more than some dozen only cost time.
MOST_TRIES = 30  # round-off | tries
# Impacts are solved to this: what they miss is energy. x10 and /10: test_impacts_are_solved_better_than_a_velocity_pass
TOLERANCE_SHARE = 1e-7  # round-off | tolerance of the velocity pass
# At least this. x10 and /10: test_impacts_are_solved_better_than_a_velocity_pass
LEAST_TOLERANCE = 1e-8  # round-off | restitution threshold
# At most this. x10 and /10: test_impacts_are_solved_better_than_a_velocity_pass
MOST_TOLERANCE = 1e-4  # round-off | restitution threshold
# Energy that impacts of a contact group may create: they are solved no better.
# x10 and /10: test_energy_that_impacts_create_counts_beyond_what_they_are_solved_to
IMPACT_ROUND_OFF = 1e-9  # round-off | kinetic energy of the group

# Soil and SPH

# What is nearer to touching a body than this at the start is in contact.
# x10 and /10: test_particle_that_nearly_touches_a_body_at_the_start_is_pressed_against_it
AT_TOUCH = 1e-3  # calibrated | radius of a particle
# Side of the cells that clusters of particles are made from.
CLUSTER_CELL = 2.0  # cost | spacing
# Smallest eigenvalue of M with which a particle is corrected: 1 inside, 0.5 on a flat surface, above 0.1 in a corner.
# What lies beyond is no surface but a few particles that fly.
# x10: test_a_corrected_gradient_is_exact_for_linear_fields_at_surfaces_too
LEAST_SPREAD = 0.05  # calibrated | inside
# Keeps the viscosity finite where two particles meet.
# Nothing notices: ten times as much makes the viscosity of particles at rest 16 % less, a tenth 2 % more.
SOFTENING = 0.01  # smoothing | square of the smoothing length
# Rate -z at which the rows along a face lose its influence, for Wendland's C2 with h = 1.5 spacings.
# x10 and /10: test_the_decay_from_row_to_row_is_that_of_the_kernel_on_its_lattice
DECAY = 0.2383014  # round-off | influence on the row before
# Rows nearer than this to where they ought to be stand against a face.
# /10: test_soil_at_rest_starts_with_all_forces_in_equilibrium
OUT_OF_LINE = 1e-3  # calibrated | spacing
# Eigenvalues below count as zero: of neighbours on a line one is zero up to round-off.
# Nothing notices: any value between round-off and what a few neighbours out of line have would do.
GRADIENT_RANK = 1e-8  # round-off | scale of the matrix
# With numbers up to this, and down to its inverse, no product in a sum overflows or vanishes.
# x10: test_particles_that_make_no_sense_are_refused; /10: test_numbers_at_the_limits_overflow_nowhere
LARGEST = 1e30  # round-off | any unit
