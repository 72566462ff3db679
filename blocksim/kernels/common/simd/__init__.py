"""Four numbers at a time: what a processor does to four rows of one colour with one instruction each.

A value of type Lanes is a vector register with four doubles, a mask one with four flags. Compiled code has the
operators + - * / abs < <= > >= & | ^ for them, between lanes or with one number for all four, and the functions of
functions.py. Every lane is rounded as a single number would be, so that results do not depend on who shares a register
with whom. Without the compiler the same values are numpy arrays.
"""

from blocksim.kernels.common.simd.code import teach_compiler
from blocksim.kernels.common.simd.functions import (
    WIDTH,
    Lane,
    Lanes,
    Mask,
    branch,
    fields_0,
    fields_4,
    fields_8,
    fields_12,
    fields_16,
    four,
    greater,
    is_all,
    lesser,
    load,
    root,
    select,
    split,
    spread,
    store,
    write_fields_0,
    write_fields_4,
    write_fields_8,
)

teach_compiler()

__all__ = [
    "WIDTH",
    "Lane",
    "Lanes",
    "Mask",
    "branch",
    "fields_0",
    "fields_4",
    "fields_8",
    "fields_12",
    "fields_16",
    "four",
    "greater",
    "is_all",
    "lesser",
    "load",
    "root",
    "select",
    "split",
    "spread",
    "store",
    "write_fields_0",
    "write_fields_4",
    "write_fields_8",
]
