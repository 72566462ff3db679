"""Energy ledger: what the scene holds now. Losses are tallied where forces are added up (step.py, history.py)."""

from blocksim.kernels.common import arrays, energy, integrate, jit
from blocksim.kernels.explicit import history, laws

LEDGER_ROW = (
    "kinetic",
    "potential",
    "stored_normal",
    "stored_shear",
    "dashpot",
    "friction",
    "broken",
    "to_support",
    "to_loads",
    "events",
)


@jit.rare_kernel
def contact_summary(world: arrays.World) -> tuple[float, float, int, float]:
    """Return energy stored in normal and in shear springs (J), number of contacts, largest overlap (m)."""
    normal = 0.0
    shear = 0.0
    count = 0
    largest = 0.0
    exponent = world.controls[0].exponent
    for p in range(world.clock[0].pair_count):
        pair = world.pairs[p]
        if pair.active > 0:
            values = world.interactions[world.bodies[pair.a].contact_class, world.bodies[pair.b].contact_class]
            for k in range(pair.active):
                contact = world.contacts[p, k]
                of_spring = history.stiffness_before(contact, pair.stiffness, values, world.particles)
                stiffness = history.shear_stiffness_before(contact, of_spring, values, exponent)
                normal += laws.stored_energy(exponent, of_spring, contact.depth)
                shear += 0.5 * stiffness * contact.spring * contact.spring
                count += 1
                largest = max(largest, contact.depth)
    return normal, shear, count, largest


@jit.rare_kernel
def tallied(ledger: arrays.Records) -> tuple[float, float, float]:
    """Return the losses (J) to dashpots, friction and broken contacts, summed over all groups of pairs in order."""
    dashpot = 0.0
    friction = 0.0
    broken = 0.0
    for tally in ledger:
        dashpot += tally.dashpot
        friction += tally.friction
        broken += tally.broken
    return dashpot, friction, broken


@jit.rare_kernel
def given_to_loads(ledger: arrays.Records) -> float:
    """Return the work (J) done on loads, against that which they do, summed over all groups of bodies in order."""
    total = 0.0
    for tally in ledger:
        total += tally.to_loads
    return total


@jit.entry_kernel
def measure(world: arrays.World, row: arrays.Floats) -> None:
    """Write one row of the ledger: energies (J) as in `LEDGER_ROW`, number of contacts, largest overlap (m)."""
    ledger = world.ledger[0]
    normal, shear, count, largest = contact_summary(world)
    row[0] = integrate.kinetic_energy(world)
    row[1] = energy.potential_energy(world)
    row[2] = normal
    row[3] = shear
    row[4], row[5], row[6] = tallied(world.ledger)
    row[7] = ledger.to_support
    row[8] = given_to_loads(world.ledger)
    row[9] = ledger.events
    row[10] = count
    row[11] = largest
