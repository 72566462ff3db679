"""Scenes of one shape in one: every array gets the members along its first axis."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import zeros
from blocksim.simulation.schemes import Scene


def shape_of(scene: Any) -> tuple[Any, ...]:
    """Return what scenes must have in common to be stacked: shapes and types of all arrays."""
    if isinstance(scene, np.ndarray):
        return (*scene.shape, scene.dtype.str)
    return () if scene is None else tuple(shape_of(part) for part in scene)


def arrays_of(scene: Any) -> list[NDArray[Any]]:
    """Return all arrays of a scene."""
    if isinstance(scene, np.ndarray):
        return [scene]
    return [] if scene is None else [array for part in scene for array in arrays_of(part)]


def stack(scenes: Sequence[Scene]) -> Scene:
    """Return one scene from several of one shape."""
    stacked: Scene = _joined(_stacked, scenes)
    return stacked


def member(scenes: Scene, m: int) -> Scene:
    """Return one of the scenes that were stacked; it shares their memory."""
    one: Scene = _joined(lambda arrays: arrays[0][m], [scenes])
    return one


def _joined(join: Callable[[Sequence[NDArray[Any]]], Any], scenes: Sequence[Any]) -> Any:
    first = scenes[0]
    if isinstance(first, np.ndarray):
        return join(scenes)
    if first is None:
        return None
    parts: Iterable[Any] = (_joined(join, same) for same in zip(*scenes, strict=True))
    return type(first)(*parts)


def _stacked(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return arrays of one shape as one, whose memory starts on a cache line."""
    first = arrays[0]
    whole = zeros((len(arrays), *first.shape), first.dtype).view(type(first))
    np.stack(arrays, out=whole)
    return whole
