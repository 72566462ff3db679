"""Histories of the whole scene: energies, contacts, support force, the ground's motion."""

from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.simulation.contacts import borne
from blocksim.view import style
from blocksim.view.curves import limits_of
from blocksim.view.forces import WithContacts, contacts_of
from blocksim.view.moments import Floats, Indices
from blocksim.view.support import Support
from blocksim.view.window import MILLIMETRES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_WEIGHTS = 3.0  # of all blocks: forces of supports beyond that are cut, those of impacts are far beyond
SMALL_SHARE = 1e-3  # of the largest energy; what stays below is not drawn
LEAST_ANGLE = 0.05  # degrees; motion closer to x is along x
ENERGIES = {  # how entries of the ledger are drawn together
    "kinetic": ("kinetic",),
    "potential": ("potential",),
    "stored in contacts": ("stored_normal", "stored_shear"),
    "lost to friction": ("friction",),
    "lost in impacts": ("dashpot", "broken", "impacts", "correction"),
    "given to support": ("to_support",),
}
ENERGY_LOOKS: dict[str, tuple[str, Any]] = {  # the same in every picture; dashes distinguish them in grey
    "kinetic": ("#0072B2", "-"),
    "potential": ("#E69F00", "-"),
    "stored in contacts": ("#CC79A7", (0, (1, 1))),
    "lost to friction": ("#009E73", (0, (5, 1.5))),
    "lost in impacts": ("#222222", (0, (3, 1, 1, 1))),
    "given to support": ("#56B4E9", (0, (2, 1))),
}
OTHER_ENERGY: tuple[str, Any] = ("#999999", "-")
BESIDE: dict[str, Any] = {
    "loc": "upper left",
    "bbox_to_anchor": (1.04, 1.0),
    "frameon": False,
    "borderaxespad": 0.0,
    "handlelength": 2.0,
}
Entries = dict[str, Floats]


def drawn_energies(energy: Entries, chosen: Indices) -> Entries:
    """Return the energies (J) to draw by name: all that matter, potential relative to its minimum."""
    known = {entry for entries in ENERGIES.values() for entry in entries}
    groups = {**ENERGIES, **{name.replace("_", " "): (name,) for name in energy if name not in known}}
    sums = {
        label: np.sum([energy[entry][chosen] for entry in entries if entry in energy], axis=0)
        for label, entries in groups.items()
        if any(entry in energy for entry in entries)
    }
    if "potential" in sums:
        sums["potential"] = sums["potential"] - sums["potential"].min()
    most = max((float(np.abs(values).max()) for values in sums.values()), default=0.0)
    return {label: values for label, values in sums.items() if float(np.abs(values).max()) > SMALL_SHARE * most}


def support_force(frames: WithContacts, chosen: Indices, support: Support) -> Floats:
    """Return the upward force (N) of the supports on all free blocks, (n,).

    Raises InvalidInputError where contacts were not stored.
    """
    up = float(np.sin(support.tilt)), float(np.cos(support.tilt))
    return borne(contacts_of(frames), up, support.fixed)[chosen]


def unit_for(most: float, unit: str) -> tuple[float, str]:
    """Return factor and unit in which values up to this one (J, N) are best read."""
    for factor, prefix in ((1e-3, "k"), (1.0, ""), (1e3, "m")):
        if most * factor >= 1.0:
            return factor, f"{prefix}{unit}"
    return 1e6, f"µ{unit}"


def draw_energies(axes: "Axes", time: Floats, energies: Entries) -> None:
    """Draw energies (J) by name, each in its own colour and dashes."""
    factor, unit = unit_for(max((float(np.abs(values).max()) for values in energies.values()), default=0.0), "J")
    for label, values in energies.items():
        colour, dashes = ENERGY_LOOKS.get(label, OTHER_ENERGY)
        axes.plot(time, factor * values, color=colour, linestyle=dashes, linewidth=1.1, label=label)
    axes.set_ylabel(f"energy ({unit})")
    if energies:
        axes.legend(**BESIDE)


def draw_contacts(axes: "Axes", time: Floats, count: Floats) -> None:
    """Draw the number of contacts."""
    axes.plot(time, count, color=style.INK, linewidth=0.8, drawstyle="steps-post")
    axes.set_ylabel("contacts")
    axes.set_ylim(bottom=0.0)


def draw_force(axes: "Axes", time: Floats, force: Floats, weight: float) -> None:
    """Draw the support force with the weight (N); where it is cut, its largest value is printed."""
    largest, reference = float(force.max(initial=0.0)), weight or float(np.median(force)) or 1.0
    factor, unit = unit_for(reference, "N")
    axes.plot(time, factor * force, color=style.INK, linewidth=0.8)
    axes.axhline(factor * weight, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (4, 3)))
    axes.set_ylabel(f"support force ({unit})")
    axes.set_ylim(0.0, factor * min(max(1.1 * largest, 1.5 * reference), MOST_WEIGHTS * reference))
    told = f"upwards, from ground,\nwalls and fixed bodies\ndashed: weight {factor * weight:.3g} {unit}"
    more = f"\nlargest: {factor * largest:.3g} {unit}" if largest > MOST_WEIGHTS * reference else ""
    axes.text(1.04, 1.0, told + more, transform=axes.transAxes, va="top")


def draw_ground(axes: "Axes", time: Floats, support: Support) -> None:
    """Draw the displacement of ground, walls and fixed bodies."""
    moved = MILLIMETRES * support.displacement(time)
    axes.plot(time, moved, color=style.INK, linewidth=1.0)
    axes.set_ylim(*limits_of(moved))
    axes.set_ylabel("ground (mm)")
    turn = float(np.degrees(np.arctan2(*support.direction[::-1])))
    along = "along x" if abs(turn) < LEAST_ANGLE else f"at {turn:.3g}° to x".replace("-", "−")
    told = f"displacement of\nthe ground {along}" if support.motion is not None else "at rest"
    axes.text(1.04, 1.0, told, transform=axes.transAxes, va="top")
