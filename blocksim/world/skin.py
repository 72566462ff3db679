"""The skin of the list of neighbours: as the scenario asks, or a share of the smallest side.

Bodies no farther apart than the skin are listed, and only listed ones are looked at for contacts. The list is made
again before two that are not in it can meet, so that a skin decides how long the list is and how often it is made, and
never what moves where. Particles need nothing on top: those of the `particles` model lie inside of the block's edge,
and those of the `kernel` model touch nothing before they are inside the other block, however far the kernel reaches.
"""

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.world.bounds import Bounds
from blocksim.world.step import expected_load

# Shares of the smallest side, measured: in the surface model a body has eight corners to look at, so that a long list
# costs less than making it again; with particles a long list holds hundreds of them a pair.
SKIN_SHARE = 0.25
SKIN_SHARE_OF_PARTICLES = 0.05
MILLI = 1e3


class SkinTooSmallError(InvalidInputError):
    """Two blocks at `speed` (m/s) come nearer in a `step` (s) than the skin (m) given by hand."""

    def __init__(self, skin: float, speed: float, step: float) -> None:
        """Say by how much, as that is the least skin."""
        super().__init__(
            f"{MILLI * skin:.4g} mm is too small for this time step: two blocks that meet at {speed:.4g} m/s each come "
            f"{MILLI * nearer_in_a_step(speed, step):.4g} mm nearer in {step:.4g} s, and the contact would be missed"
        )


def nearer_in_a_step(speed: float, step: float) -> float:
    """Return how much nearer (m) two bodies come in a step (s) that meet at this speed (m/s) each."""
    return 2.0 * speed * step


def choose_skin(scenario: Scenario, bounds: Bounds, step: float) -> float:
    """Return the skin (m) the run will have, given the step (s).

    Raises SkinTooSmallError. Only for a skin given by hand: in a step by the rules two blocks come nearer by about a
    tenth of their overlap in the impact that follows, and the usual limit of overlap keeps that below the default.
    """
    given = scenario.contact.skin
    if given is None:
        share = SKIN_SHARE if scenario.contact.model == "surface" else SKIN_SHARE_OF_PARTICLES
        return bounds.smallest * share
    speed = expected_load(scenario, bounds).speed
    # a list holds for one step at least, even where it is made again at every one
    if given < nearer_in_a_step(speed, step):
        raise SkinTooSmallError(given, speed, step)
    return given
