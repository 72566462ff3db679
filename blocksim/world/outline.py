"""What a scenario places where, before there are arrays: it decides how large they are."""

from collections.abc import Sequence
from typing import NamedTuple

from blocksim.kernels.arrays import Records
from blocksim.scenario import PlacedBody, PlacedSegment, Scenario, place_bodies, place_segments
from blocksim.world.interactions import ContactClass, Interactions, contact_classes, interactions_of
from blocksim.world.motion import motion_records


class Outline(NamedTuple):
    """One scene."""

    scenario: Scenario
    placed: tuple[PlacedBody, ...]
    segments: tuple[PlacedSegment, ...]
    classes: tuple[ContactClass, ...]
    interactions: Interactions
    motion: Records  # (m,) MOTION_PIECE

    @property
    def shape(self) -> tuple[str, int, int, int, int]:
        """What scenes must have in common to be built together."""
        model = self.scenario.contact.model
        return model, len(self.placed), len(self.segments), len(self.classes), self.motion.size


def outline_of(scenario: Scenario) -> Outline:
    """Return the outline of a scenario."""
    placed = place_bodies(scenario)
    classes = contact_classes(scenario, placed)
    interactions = interactions_of(scenario, classes)
    return Outline(scenario, placed, place_segments(scenario), classes, interactions, motion_records(scenario))


Outlines = Sequence[Outline]
"""Those of several scenes; where arrays are made of them, of one shape."""
