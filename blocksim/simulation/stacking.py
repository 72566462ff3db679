"""The arrays that scenes consist of."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def arrays_of(scene: Any) -> list[NDArray[Any]]:
    """Return all arrays of a scene, or of a stack of scenes."""
    if isinstance(scene, np.ndarray):
        return [scene]
    return [] if scene is None else [array for part in scene for array in arrays_of(part)]
