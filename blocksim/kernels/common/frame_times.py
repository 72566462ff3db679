"""At which steps frames fall. Plain Python, as readers of results use it too; compiled where members are watched."""


def next_frame(done: int, period: float) -> int:
    """Return the next step with a frame after `done` steps, given the steps (not rounded) between two frames."""
    number = int(done / period)
    while round(number * period) <= done:
        number += 1
    return round(number * period)
