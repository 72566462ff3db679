"""What scenes of one shape begin with: bodies, and how the broad phase and the models of particles divide them."""

from collections.abc import Hashable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import SLOTS, Records, zeros
from blocksim.world.outline import Outlines
from blocksim.world.particles import place_particles, slots_of_a_pair

MOST_LARGE = 64  # bodies that are looked at one by one, outside the grid of the broad phase
LARGE_RATIO = 4.0  # over the smallest body; nothing is large below that
SURFACE = "surface"  # the model without particles
Floats = NDArray[np.float64]


class Parts(NamedTuple):
    """Of m scenes of one shape."""

    outlines: Outlines
    bodies: Records  # (m, n + 1) BODY
    cell_radius: Floats  # (m,) m
    particles: Records | None  # (m, q) PARTICLE
    slots: int  # of a pair

    @property
    def is_large(self) -> NDArray[np.bool_]:
        """Which bodies (m, n) stay out of the grid; equally many in each scene."""
        return _is_large(self.bodies, self.cell_radius)

    def chosen(self, numbers: Sequence[int]) -> "Parts":
        """Return the parts of some of the scenes."""
        if len(numbers) == len(self.outlines):
            return self
        return Parts(
            [self.outlines[k] for k in numbers],
            some(self.bodies, numbers),
            self.cell_radius[list(numbers)],
            None if self.particles is None else some(self.particles, numbers),
            self.slots,
        )


class _Boundary(NamedTuple):
    """What the bodies of one scene touch others with."""

    particles: Records | None
    slots: int  # of a pair


def parts_of(outlines: Outlines, bodies: Records, model: str) -> Iterator[tuple[list[int], Parts]]:
    """Yield the parts of scenes of one outline, all those of one shape together, and which they are."""
    if not outlines:
        return
    radius = cell_radius(bodies)
    boundaries = _boundaries(outlines, bodies, model)
    counts = zip(
        np.count_nonzero(_is_large(bodies, radius), axis=1),
        np.count_nonzero(bodies["is_moved"], axis=1),
        ((one.slots, None if one.particles is None else one.particles.size) for one in boundaries),
        strict=True,
    )
    parts = Parts(outlines, bodies, radius, None, SLOTS)
    for same in alike(list(counts)):
        one = parts.chosen(same)._replace(slots=boundaries[same[0]].slots)
        particles = [found for k in same if (found := boundaries[k].particles) is not None]
        yield same, one._replace(particles=joined(particles)) if particles else one


def _boundaries(outlines: Outlines, bodies: Records, model: str) -> list[_Boundary]:
    """Return boundaries; fills the fields of the bodies that are about particles."""
    if model == SURFACE:
        return [_Boundary(None, SLOTS)] * len(outlines)
    return [
        _Boundary(place_particles(one, model, outline.scenario.contact.particle_spacing), slots_of_a_pair(one, model))
        for one, outline in zip(bodies, outlines, strict=True)
    ]


def alike(keys: Sequence[Hashable]) -> list[list[int]]:
    """Return the places of equal keys, in the order in which each comes first."""
    places: dict[Hashable, list[int]] = {}
    for place, key in enumerate(keys):
        places.setdefault(key, []).append(place)
    return list(places.values())


def cell_radius(bodies: Records) -> Floats:
    """Return the half diagonal (m) of the largest of the bodies (..., n + 1) in the grid.

    In it are all but a few pieces of ground and planks.
    """
    radii = np.sort(bodies["radius"][..., :-1], axis=-1)
    few = min(MOST_LARGE, radii.shape[-1] // 8)
    count = np.count_nonzero(radii <= LARGE_RATIO * radii[..., :1], axis=-1)
    smaller = np.take_along_axis(radii, np.asarray(count)[..., np.newaxis] - 1, axis=-1)[..., 0]
    radius: Floats = np.maximum(radii[..., -1 - few], smaller)
    return radius


def joined(records: Sequence[Records]) -> Records:
    """Return records (k,) of m scenes as one array (m, k)."""
    whole = zeros((len(records), records[0].size), records[0].dtype)
    plain = whole.view(np.ndarray)
    for m, one in enumerate(records):
        plain[m] = one
    return whole


def _is_large(bodies: Records, radius: Floats) -> NDArray[np.bool_]:
    is_large: NDArray[np.bool_] = bodies["radius"][:, :-1] > radius[:, np.newaxis]
    return is_large


def some(records: Records, numbers: Sequence[int]) -> Records:
    """Return the records of some of the scenes (m, ...), from a cache line on; all of them as they are."""
    if len(numbers) == len(records):
        return records
    chosen = zeros((len(numbers), *records.shape[1:]), records.dtype)
    chosen[...] = records[list(numbers)]
    return chosen
