"""Sweeps over the rows, colour after colour. Rows of one colour share no free body: threads divide them."""

from blocksim.kernels.arrays import Integers
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.nonsmooth.arrays import PART, Contacts
from blocksim.kernels.nonsmooth.passes import aim, book_row, position_row, velocity_row, warm_row


@kernel
def part_of(begin: int, end: int, k: int, size: int) -> tuple[int, int]:
    """Return where the part of thread k begins and ends: whole books, so that no two threads write to one."""
    if size == 1:
        return begin, end
    blocks = (end - begin + PART - 1) // PART
    return min(end, begin + blocks * k // size * PART), min(end, begin + blocks * (k + 1) // size * PART)


@rare_kernel
def warm_rows(contacts: Contacts, begin: int, end: int) -> None:
    """Warm-start some active rows."""
    for m in range(begin, end):
        row = contacts.rows[contacts.active[m]]
        warm_row(row, contacts.lines[row.a], contacts.lines[row.b])


@rare_kernel
def position_rows(contacts: Contacts, begin: int, end: int) -> None:
    """Go through the position pass of some active rows."""
    stepping = contacts.stepping[0]
    for m in range(begin, end):
        row = contacts.rows[contacts.active[m]]
        position_row(row, contacts.lines[row.a], contacts.lines[row.b], stepping)


@rare_kernel
def first_velocity_rows(contacts: Contacts, begin: int, end: int) -> float:
    """Begin the velocity pass of some active rows; return the largest change of velocity (m/s)."""
    largest = 0.0
    for m in range(begin, end):
        row = contacts.rows[contacts.active[m]]
        a = contacts.lines[row.a]
        b = contacts.lines[row.b]
        aim(contacts, row, a, b)
        largest = max(largest, velocity_row(row, a, b, contacts.touches[row.touch]))
    return largest


@rare_kernel
def velocity_rows(contacts: Contacts, begin: int, end: int) -> float:
    """Go once more through the velocity pass of some active rows; return the largest change of velocity (m/s)."""
    largest = 0.0
    for m in range(begin, end):
        row = contacts.rows[contacts.active[m]]
        a = contacts.lines[row.a]
        b = contacts.lines[row.b]
        largest = max(largest, velocity_row(row, a, b, contacts.touches[row.touch]))
    return largest


@rare_kernel
def book_rows(contacts: Contacts, begin: int, end: int, gx: float, gy: float, hx: float, hy: float) -> None:
    """Book some active rows."""
    for m in range(begin, end):
        book_row(contacts, contacts.rows[contacts.active[m]], gx, gy, hx, hy, contacts.books[m // PART])


@rare_kernel
def gather(contacts: Contacts, begins: Integers) -> None:
    """List the rows that are on, colour after colour."""
    stepping = contacts.stepping[0]
    count = 0
    for colour in range(stepping.colours):
        contacts.ends[colour] = count
        for r in range(begins[colour], begins[colour + 1]):
            if contacts.rows[r].is_on:
                contacts.active[count] = r
                count += 1
    contacts.ends[stepping.colours] = count
    stepping.active_count = count
