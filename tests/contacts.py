"""Contacts of scenes on springs, as the kernels keep them."""

from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import World


def contact_records(world: World) -> Any:
    """Return the records of all contacts, pair after pair."""
    count = int(world.clock[0].pair_count)
    is_active = np.arange(world.contacts.shape[1]) < world.pairs.active[:count, np.newaxis]
    return world.contacts[:count][is_active]
