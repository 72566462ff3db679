"""How much long tests try: all, or a tenth where the environment says BLOCKSIM_LONG=tenth, as .ci/run does."""

import os


def in_all(count: int) -> int:
    """Return how many examples, kills or interruptions a long test has; at least two."""
    return max(2, count // 10) if os.environ.get("BLOCKSIM_LONG") == "tenth" else count
