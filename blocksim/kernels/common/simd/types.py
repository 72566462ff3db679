"""The types of four numbers and of four flags in compiled code: vector registers."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import models, register_model

from blocksim.kernels.common.simd.functions import WIDTH

DOUBLE = ir.DoubleType()
VECTOR = ir.VectorType(DOUBLE, WIDTH)
BYTE = ir.IntType(8)
INDEX = ir.IntType(32)
SIZE = ir.IntType(64)
ALIGNMENT = 8  # bytes that may be relied on


class LanesType(types.Type):
    """The type of four doubles in compiled code."""

    def __init__(self) -> None:
        """Name it."""
        super().__init__(name="Lanes")


class MaskType(types.Type):
    """The type of four flags in compiled code."""

    def __init__(self) -> None:
        """Name it."""
        super().__init__(name="Mask")


LANES, MASK = LanesType(), MaskType()


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, VECTOR)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: Any) -> None:
        super().__init__(manager, of, ir.VectorType(ir.IntType(1), WIDTH))
