"""Boundary particles of all bodies for the contact models `particles` and `kernel`."""

import math

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import ALL, PARTICLE, SLOTS, Record, Records, zeros
from blocksim.kernels.explicit.models.particles import PER_PARTICLE

CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
NORMALS = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))


def place_particles(bodies: Records, model: str, spacing: float) -> Records | None:
    """Give every body its boundary particles: fills its row and range fields and returns the particles of all.

    `spacing` (m) is the largest distance of neighbours; bodies of equal sides share their particles. The surface model
    has none: None.
    """
    if model == "surface":
        return None
    rows = kernel_rows if model == "kernel" else disc_rows
    known: dict[tuple[float, ...], tuple[int, Records]] = {}
    total = 0
    for body in bodies[:-1]:
        inset = 0.0 if model == "kernel" else 0.5 * spacing
        body.row_x = division(2.0 * (body.half_x - inset), spacing) if body.faces == ALL else 1
        body.row_y = division(2.0 * (body.half_y - inset), spacing) if body.faces == ALL else 1
        key = (body.half_x, body.half_y, body.faces, body.corners)
        if key not in known:
            known[key] = (total, rows(body, inset) if body.faces == ALL else free_ends(body, model))
            total += known[key][1].size
        body.first_particle, body.particle_count = known[key][0], known[key][1].size
    particles = zeros(total, PARTICLE)
    for first, part in known.values():
        particles[first : first + part.size] = part
    return particles


def kernel_rows(body: Record, inset: float) -> Records:
    """Return four rows on the true edge, counter-clockwise from the lower left corner, both ends of each included.

    Tributary lengths are half an interval at the ends, so that those of a face sum to its length.
    """
    parts = []
    for start, normal, count in _rows(body):
        row = zeros(count + 1, PARTICLE)
        _line(row, body, inset, start, np.arange(count + 1) / count)
        row.nx, row.ny = row.mx, row.my = normal
        row[0].mx, row[0].my = NORMALS[start - 1]
        row[-1].mx, row[-1].my = NORMALS[(start + 1) % 4]
        row["share"] = 1.0 / count
        row["share"][[0, -1]] = 0.5 / count
        row["length"] = row["share"] * 2.0 * (body.half_x if normal[0] == 0.0 else body.half_y)
        parts.append(row)
    return np.concatenate(parts).view(np.recarray)


def disc_rows(body: Record, inset: float) -> Records:
    """Return the centres of discs, inset from the edge, counter-clockwise from the lower left one, corners once.

    A corner stands for half an interval of each of its two faces.
    """
    parts = []
    counts = [count for _, _, count in _rows(body)]
    sides = [2.0 * (side - inset) for side in (body.half_x, body.half_y)] * 2
    for k, (start, normal, count) in enumerate(_rows(body)):
        row = zeros(count, PARTICLE)
        _line(row, body, inset, start, np.arange(count) / count)
        row.nx, row.ny = row.mx, row.my = normal
        row["share"] = 1.0 / count
        row["share"][0] = 0.5 / count + 0.5 / counts[k - 1]
        row["length"] = sides[k] / count
        row["length"][0] = 0.5 * (sides[k] / count + sides[k - 1] / counts[k - 1])
        parts.append(row)
    return np.concatenate(parts).view(np.recarray)


def free_ends(body: Record, model: str) -> Records:
    """Return the particles of a piece of ground: its free ends, which blocks can land on; discs see its line only."""
    ends = [k for k in (2, 3) if body.corners >> k & 1] if model == "kernel" else []
    row = zeros(len(ends), PARTICLE)
    for particle, k in zip(row, ends, strict=True):
        particle.x, particle.y = CORNERS[k][0] * body.half_x, body.half_y
        particle.ny = particle.my = 1.0
        particle.share = 0.5
    return row


def slots_of_a_pair(bodies: Records, model: str) -> int:
    """Return how many contact slots the pair of the two largest bodies needs."""
    most = int(bodies["particle_count"].max())
    return {"surface": SLOTS, "kernel": 2 * most, "particles": PER_PARTICLE * most}[model]


def division(side: float, spacing: float) -> int:
    """Return the number of equal intervals, none longer than `spacing`, that a side (both m) is divided into."""
    # a quotient that round-off lifted just over an integer must not add a particle
    return max(1, math.ceil(side / spacing * (1.0 - 1e-12)))


def _rows(body: Record) -> list[tuple[int, tuple[float, float], int]]:
    """Return start corner, normal and number of intervals of every row."""
    return [(k, NORMALS[k], int(body.row_x if k % 2 == 0 else body.row_y)) for k in range(4)]


def _line(row: Records, body: Record, inset: float, start: int, share: NDArray[np.float64]) -> None:
    begin, end = np.array(CORNERS[start]), np.array(CORNERS[(start + 1) % 4])
    places = (begin + (end - begin) * share[:, None]) * (body.half_x - inset, body.half_y - inset)
    row["x"], row["y"] = places[:, 0], places[:, 1]
