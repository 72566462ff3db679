"""The skin of the list of neighbours: as the scenario asks, or a share of the smallest side.

Bodies no farther apart than the skin are listed, and only listed ones are looked at for contacts. The list is made
again before two that are not in it can meet, so that a skin decides how long the list is and how often it is made, and
never what moves where. Particles need nothing on top: those of the `particles` model lie inside of the block's edge,
and those of the `kernel` model touch nothing before they are inside the other block, however far the kernel reaches.
"""

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.models.stepping import Nonsmooth
from blocksim.world.bounds import Bounds
from blocksim.world.interactions import Interactions
from blocksim.world.speeds import greatest_speed, support_speed

# Shares of the smallest side, measured: in the surface model a body has eight corners to look at, so that a long list
# costs less than making it again; with particles a long list holds hundreds of them a pair.
SKIN_SHARE = 0.25
SKIN_SHARE_OF_PARTICLES = 0.05
RESERVE = 2.5  # times the speed expected: blocks that are struck are faster; the automatic step leaves as much
ROUND_UP = 1.0005  # so that four digits of a number are not less than it
MILLI = 1e3


class SkinTooSmallError(InvalidInputError):
    """Two blocks at `speed` (m/s) come too near in a `step` (s) for the skin (m) given by hand; `least` in m."""

    def __init__(self, skin: float, least: float, speed: float, step: float) -> None:
        """Say by how much, and the least skin."""
        self.least = least
        super().__init__(
            f"{MILLI * skin:.4g} mm is too small for this time step: two blocks that meet at {speed:.4g} m/s each come "
            f"{MILLI * nearer_in_a_step(speed, step):.4g} mm nearer in {step:.4g} s, and the contact could be missed; "
            f"at least {MILLI * ROUND_UP * least:.4g} mm is needed. Leave skin out for the default"
        )


def nearer_in_a_step(speed: float, step: float) -> float:
    """Return how much nearer (m) two bodies come in a step (s) that meet at this speed (m/s) each."""
    return 2.0 * speed * step


def choose_skin(scenario: Scenario, bounds: Bounds, table: Interactions, step: float) -> float:
    """Return the skin (m) the run will have, given the step (s).

    Raises SkinTooSmallError. Only for a skin given by hand: in a step by the rules two blocks come nearer by at most
    0.4 of the default. With springs a block that outruns the list ends the run, so that there is a reserve. Rigid
    contacts are found late then, and all blocks look ahead as far as they move in a step: that is enough.
    """
    given = scenario.contact.skin
    if given is None:
        share = SKIN_SHARE_OF_PARTICLES if _has_particles(scenario) else SKIN_SHARE
        return bounds.smallest * share
    speed = greatest_speed(scenario, bounds, table) + support_speed(scenario)
    reserve = 1.0 if isinstance(scenario.time, Nonsmooth) else RESERVE
    # a list holds for one step at least, even where it is made again at every one
    least = reserve * nearer_in_a_step(speed, step)
    if given < least:
        raise SkinTooSmallError(given, least, speed, step)
    return given


def _has_particles(scenario: Scenario) -> bool:
    return scenario.contact.model != "surface" and not isinstance(scenario.time, Nonsmooth)
