"""Energy ledger: what the scene holds now. Losses are booked where the forces are applied (contact.py)."""

from blocksim.kernels.arrays import NO_FACE, SLOTS, Floats, World
from blocksim.kernels.integrate import kinetic_energy
from blocksim.kernels.jit import rare_kernel
from blocksim.kernels.laws import stored_energy

LEDGER_ROW = ("kinetic", "potential", "stored_normal", "stored_shear", "dashpot", "friction", "broken")


@rare_kernel
def potential_energy(world: World) -> float:
    """Return the energy (J) of all masses in the field of gravity, zero at the origin."""
    total = 0.0
    controls = world.controls[0]
    for i in range(world.bodies.size - 1):
        body = world.bodies[i]
        total -= body.mass * (controls.gravity_x * body.x + controls.gravity_y * body.y)
    return total


@rare_kernel
def contact_summary(world: World) -> tuple[float, float, int, float]:
    """Return energy stored in normal and in shear springs (J), number of contacts, largest overlap (m)."""
    normal = 0.0
    shear = 0.0
    count = 0
    largest = 0.0
    law = world.controls[0].law
    for p in range(world.clock[0].pair_count):
        pair = world.pairs[p]
        if pair.active > 0:
            values = world.interactions[world.bodies[pair.a].contact_class, world.bodies[pair.b].contact_class]
            for k in range(SLOTS):
                slot = world.slots[p, k]
                if slot.face != NO_FACE:
                    normal += stored_energy(law, values.normal_stiffness, slot.depth)
                    shear += 0.5 * values.shear_stiffness * slot.spring * slot.spring
                    count += 1
                    largest = max(largest, slot.depth)
    return normal, shear, count, largest


@rare_kernel
def measure(world: World, row: Floats) -> None:
    """Write one row of the ledger: energies (J) as in `LEDGER_ROW`, number of contacts, largest overlap (m)."""
    ledger = world.ledger[0]
    normal, shear, count, largest = contact_summary(world)
    row[0] = kinetic_energy(world)
    row[1] = potential_energy(world)
    row[2] = normal
    row[3] = shear
    row[4] = ledger.dashpot
    row[5] = ledger.friction
    row[6] = ledger.broken
    row[7] = count
    row[8] = largest
