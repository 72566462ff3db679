"""Four numbers at a time: what a processor does to four rows of one colour with one instruction each.

A value of type Lanes is a vector register with four doubles, a mask one with four flags. Compiled code has the
operators + - * / abs < <= > >= & | ^ for them, between lanes or with one number for all four, and the public functions
below, each one instruction for four numbers wherever there is one. Every lane is rounded as a single number would be,
so that results do not depend on who shares a register with whom. Without the compiler the same values are numpy arrays.

Most functions take `lane` first: None for all four at once, or the number of the lane that is meant, so that one source
serves four rows and a single one.
"""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.extending import lower_builtin, models, register_model

from blocksim.kernels.common.arrays import Records
from blocksim.kernels.common.compiler import AbstractTemplate, cgutils, infer_global, ir, signature

WIDTH = 4  # numbers in a register
Lanes = Any  # (4,) float64
Mask = Any  # (4,) bool
Places = Any  # numbers of four records: a field of four or a tuple
Lane = Any  # None where a function is to deal with all lanes of a group at once; else the number of one


def spread(number: float) -> Lanes:
    """Return one number in all lanes."""
    return np.full(WIDTH, number)


def select(mask: Mask, yes: Lanes, no: Lanes) -> Lanes:
    """Return one or the other in every lane, or of two single numbers."""
    chosen: Any = np.where(mask, yes, no)
    return chosen[()]


def branch(mask: Mask, yes: Lanes, no: Lanes) -> Lanes:
    """Return the same as `select`; of two single numbers by a branch.

    What the processor predicts, it does not wait for: worth it where the flag is known late and seldom changes.
    """
    return select(mask, yes, no)


def greater(x: Lanes, y: Lanes) -> Lanes:
    """Return the greater number in every lane, or of two single numbers; the second where they do not compare."""
    return select(x > y, x, y)


def lesser(x: Lanes, y: Lanes) -> Lanes:
    """Return the lesser number in every lane, or of two single numbers; the second where they do not compare."""
    return select(x < y, x, y)


def root(x: Lanes) -> Lanes:
    """Return the square root in every lane, or of a single number."""
    found: Any = np.sqrt(x)
    return found


def is_all(mask: Mask) -> bool:
    """Return True if all flags are set, or a single one."""
    return bool(np.all(mask))


def split(x: Lanes) -> tuple[float, float, float, float]:
    """Return the numbers in the lanes, or a single one four times."""
    return tuple(np.broadcast_to(x, WIDTH))


def four(lane: Lane, one: float, two: float, three: float, last: float) -> Lanes:
    """Return four numbers as lanes, or the first of them where a single lane is meant."""
    return np.array([one, two, three, last]) if lane is None else one


def load(lane: Lane, field: Any) -> Lanes:
    """Return the numbers in a field of four, or the one of a lane."""
    return np.array(field) if lane is None else field[lane]


def store(lane: Lane, field: Any, x: Lanes) -> None:
    """Write a field of four numbers, or the one of a lane."""
    field[slice(None) if lane is None else lane] = x


def _fields(lane: Lane, records: Records, places: Places, first: int) -> tuple[Lanes, ...]:
    of = [records[place] for place in (places if lane is None else places[lane : lane + 1])]
    columns = [np.array([float(one[k]) for one in of]) for k in range(first, first + WIDTH)]
    return tuple(column if lane is None else column[0] for column in columns)


def fields_0(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the first four fields, all doubles, of the records at four places."""
    return _fields(lane, records, places, 0)


def fields_4(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the next four fields of the records at four places."""
    return _fields(lane, records, places, 4)


def fields_8(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the four fields after those of the records at four places."""
    return _fields(lane, records, places, 8)


def fields_12(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return the four fields after those of the records at four places; what is no double there makes no sense."""
    return _fields(lane, records, places, 12)


def fields_16(lane: Lane, records: Records, places: Places) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return four fields of the records at four places, from the seventeenth on."""
    return _fields(lane, records, places, 16)


def _write(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...], first: int) -> None:
    for k in range(WIDTH) if lane is None else [lane]:
        if np.atleast_1d(mask)[k if lane is None else 0]:
            for place, column in enumerate(columns, first):
                records[places[k]][place] = np.atleast_1d(column)[k if lane is None else 0]


def write_fields_0(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...]) -> None:
    """Write the first four fields, all doubles, of the records at four places; of those whose flag is set."""
    _write(lane, records, places, mask, columns, 0)


def write_fields_4(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...]) -> None:
    """Write the next four fields."""
    _write(lane, records, places, mask, columns, 4)


def write_fields_8(lane: Lane, records: Records, places: Places, mask: Mask, columns: tuple[Lanes, ...]) -> None:
    """Write the four fields after those."""
    _write(lane, records, places, mask, columns, 8)


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


LIKELY = (2000, 1)  # weights of a branch that is to stay one


def _spread(builder: Any, value: Any) -> Any:
    """Return a value as lanes: one number in all of them."""
    if value.type == VECTOR:
        return value
    single = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, INDEX(0))
    return builder.shuffle_vector(single, single, ir.Constant(ir.VectorType(INDEX, WIDTH), [0] * WIDTH))


def _declare(function: Callable[..., Any], answer: Callable[[tuple[Any, ...]], Any]) -> None:
    """Tell the compiler what a function returns for arguments of some types, or None where it takes no such."""

    class Template(AbstractTemplate):  # type: ignore[misc]  # Any
        def generic(self, given: Any, _: Any) -> Any:
            result = answer(given)
            return None if result is None else signature(result, *given)

    infer_global(function)(Template)


def _define(function: Callable[..., Any], result: Any, generate: Callable[..., Any], *kinds: tuple[Any, ...]) -> None:
    """Let compiled code call a function with arguments of some kinds."""
    _declare(function, lambda given: result if given in kinds else None)
    for kind in kinds:
        lower_builtin(function, *kind)(lambda _, builder, __, arguments: generate(builder, *arguments))


def _two(function: Callable[..., Any], result: Any, generate: Callable[..., Any]) -> None:
    """Define a function of two lanes, or of lanes and one number."""

    def both(builder: Any, x: Any, y: Any) -> Any:
        return generate(builder, _spread(builder, x), _spread(builder, y))

    _define(function, result, both, (LANES, LANES), (LANES, types.float64), (types.float64, LANES))


def _transposed(builder: Any, four: list[Any]) -> list[Any]:
    """Return the columns of four vectors."""

    def mixed(x: Any, y: Any, *places: int) -> Any:
        return builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(INDEX, WIDTH), list(places)))

    even = [mixed(four[k], four[k + 1], 0, 4, 2, 6) for k in (0, 2)]
    odd = [mixed(four[k], four[k + 1], 1, 5, 3, 7) for k in (0, 2)]
    low, high = (0, 1, 4, 5), (2, 3, 6, 7)
    return [mixed(*even, *low), mixed(*odd, *low), mixed(*even, *high), mixed(*odd, *high)]


def _one_of(builder: Any, lane: Any, places: list[Any]) -> Any:
    """Return the place in a lane; of a lane that is known the optimization leaves nothing but that."""
    chosen = places[0]
    for k in range(1, WIDTH):
        chosen = builder.select(builder.icmp_signed("==", lane, ir.Constant(lane.type, k)), places[k], chosen)
    return chosen


def _record_pointers(context: Any, builder: Any, signature: Any, arguments: Any, kind: Any) -> list[Any]:
    """Return pointers to the records at all places, or to that at the place of one lane."""
    array, field = signature.args[1:3]
    start = builder.bitcast(context.make_array(array)(context, builder, arguments[1]).data, BYTE.as_pointer())
    if isinstance(field, types.UniTuple):
        places = cgutils.unpack_tuple(builder, arguments[2], WIDTH)
        if signature.args[0] != types.none:
            places = [_one_of(builder, arguments[0], places)]
    else:
        first = context.make_array(field)(context, builder, arguments[2]).data
        lanes = [INDEX(k) for k in range(WIDTH)] if signature.args[0] == types.none else arguments[:1]
        places = [builder.load(builder.gep(first, [lane])) for lane in lanes]
    pointers = []
    for place in places:
        whole = builder.zext(place, SIZE) if place.type.width < SIZE.width else place
        offset = builder.mul(whole, SIZE(array.dtype.size))
        pointers.append(builder.bitcast(builder.gep(start, [offset]), kind.as_pointer()))
    return pointers


def _read_fields(part: int) -> Callable[..., Any]:
    """Return the code that reads four fields of records, from number 4 `part` on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if signature.args[0] == types.none:
            pointers = _record_pointers(context, builder, signature, arguments, VECTOR)
            four = [builder.load(builder.gep(one, [INDEX(part)]), align=ALIGNMENT) for one in pointers]
            return context.make_tuple(builder, signature.return_type, _transposed(builder, four))
        (one,) = _record_pointers(context, builder, signature, arguments, DOUBLE)
        numbers = [builder.load(builder.gep(one, [INDEX(WIDTH * part + k)])) for k in range(WIDTH)]
        return context.make_tuple(builder, signature.return_type, numbers)

    return generate


def _write_fields(part: int) -> Callable[..., Any]:
    """Return the code that writes four fields of records, from number 4 `part` on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        mask = arguments[3]
        columns = cgutils.unpack_tuple(builder, arguments[4], WIDTH)
        if signature.args[0] == types.none:
            pointers = _record_pointers(context, builder, signature, arguments, VECTOR)
            for k, four in enumerate(_transposed(builder, columns)):
                with builder.if_then(builder.extract_element(mask, INDEX(k)), likely=True):
                    builder.store(four, builder.gep(pointers[k], [INDEX(part)]), align=ALIGNMENT)
        else:
            (one,) = _record_pointers(context, builder, signature, arguments, DOUBLE)
            with builder.if_then(mask, likely=True):
                for k, column in enumerate(columns):
                    builder.store(column, builder.gep(one, [INDEX(WIDTH * part + k)]))
        return context.get_dummy_value()

    return generate


def _split(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    numbers = [builder.extract_element(arguments[0], INDEX(k)) for k in range(WIDTH)]
    return context.make_tuple(builder, signature.return_type, numbers)


def _repeat(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return context.make_tuple(builder, signature.return_type, WIDTH * list(arguments))


def _four(_: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    if signature.args[0] != types.none:
        return arguments[1]
    lanes = ir.Constant(VECTOR, ir.Undefined)
    for k, number in enumerate(arguments[1:]):
        lanes = builder.insert_element(lanes, number, INDEX(k))
    return lanes


def _field_pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Return a pointer to a field of four, or to one of its numbers."""
    start = context.make_array(signature.args[1])(context, builder, arguments[1]).data
    if signature.args[0] == types.none:
        return builder.bitcast(start, VECTOR.as_pointer())
    return builder.gep(start, [arguments[0]])


def _load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.load(_field_pointer(context, builder, signature, arguments), align=ALIGNMENT)


def _store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    builder.store(arguments[2], _field_pointer(context, builder, signature, arguments), align=ALIGNMENT)
    return context.get_dummy_value()


def _called(name: str, kind: Any) -> Callable[..., Any]:
    """Return the code that calls a function of the processor with one argument."""

    def call(builder: Any, x: Any) -> Any:
        function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind]), name)
        return builder.call(function, [x])

    return call


def _all(builder: Any, mask: Any) -> Any:
    bits = builder.bitcast(mask, ir.IntType(WIDTH))
    return builder.icmp_unsigned("==", bits, ir.Constant(bits.type, -1))


def _chosen(comparison: str) -> Callable[..., Any]:
    return lambda builder, x, y: builder.select(builder.fcmp_ordered(comparison, x, y), x, y)


def _compared(comparison: str) -> Callable[..., Any]:
    return lambda builder, x, y: builder.fcmp_ordered(comparison, x, y)


def _branched(builder: Any, flag: Any, yes: Any, no: Any) -> Any:
    """Return one of two numbers by a branch, which optimization would turn into a selection if it were not likely."""
    start, other, end = builder.block, builder.append_basic_block(), builder.append_basic_block()
    builder.cbranch(flag, end, other).set_weights(LIKELY)
    builder.position_at_end(other)
    builder.branch(end)
    builder.position_at_end(end)
    chosen = builder.phi(DOUBLE)
    chosen.add_incoming(yes, start)
    chosen.add_incoming(no, other)
    return chosen


def _define_all() -> None:
    for function, name in (
        (operator.add, "fadd"),
        (operator.sub, "fsub"),
        (operator.mul, "fmul"),
        (operator.truediv, "fdiv"),
    ):
        _two(function, LANES, lambda builder, x, y, name=name: getattr(builder, name)(x, y))
    for function, comparison in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
        _two(function, MASK, _compared(comparison))
    _define(operator.and_, MASK, lambda builder, x, y: builder.and_(x, y), (MASK, MASK))
    _define(operator.or_, MASK, lambda builder, x, y: builder.or_(x, y), (MASK, MASK))
    _define(operator.xor, MASK, lambda builder, x, y: builder.xor(x, y), (MASK, MASK))
    _define(is_all, types.boolean, _all, (MASK,))
    _define(is_all, types.boolean, lambda _, flag: flag, (types.boolean,))
    _define(operator.neg, LANES, lambda builder, x: builder.fneg(x), (LANES,))
    _define(abs, LANES, _called("llvm.fabs.v4f64", VECTOR), (LANES,))
    _define(root, LANES, _called("llvm.sqrt.v4f64", VECTOR), (LANES,))
    _define(root, types.float64, _called("llvm.sqrt.f64", DOUBLE), (types.float64,))
    _define(spread, LANES, _spread, (types.float64,))
    _two(greater, LANES, _chosen(">"))
    _two(lesser, LANES, _chosen("<"))
    _define(greater, types.float64, _chosen(">"), (types.float64, types.float64))
    _define(lesser, types.float64, _chosen("<"), (types.float64, types.float64))


def _define_select() -> None:
    """Let compiled code choose between lanes, single numbers for all lanes, or single numbers."""

    def choose(builder: Any, mask: Any, yes: Any, no: Any) -> Any:
        return builder.select(mask, _spread(builder, yes), _spread(builder, no))

    one = types.float64
    for function in (select, branch):
        _define(function, LANES, choose, (MASK, LANES, LANES), (MASK, LANES, one), (MASK, one, LANES), (MASK, one, one))
    _define(select, one, lambda builder, mask, yes, no: builder.select(mask, yes, no), (types.boolean, one, one))
    _define(branch, one, _branched, (types.boolean, one, one))


def _define_memory() -> None:
    """Let compiled code read and write lanes."""

    def typed(function: Callable[..., Any], result: Any, *kinds: Any) -> Callable[..., Any]:
        def answer(given: tuple[Any, ...]) -> Any:
            fits = len(given) == len(kinds) and all(isinstance(g, k) for g, k in zip(given, kinds, strict=True))
            return result if fits else None

        _declare(function, answer)
        return lower_builtin(function, *kinds)

    columns, single = types.UniTuple(LANES, WIDTH), types.UniTuple(types.float64, WIDTH)
    for function, part in (
        (fields_0, 0),
        (fields_4, 1),
        (fields_8, 2),
        (fields_12, 3),
        (fields_16, 4),
    ):
        typed(function, columns, types.NoneType, types.Array, types.NestedArray)(_read_fields(part))
        typed(function, columns, types.NoneType, types.Array, types.UniTuple)(_read_fields(part))
        typed(function, single, types.Integer, types.Array, types.NestedArray)(_read_fields(part))
        typed(function, single, types.Integer, types.Array, types.UniTuple)(_read_fields(part))
    for writer, part in ((write_fields_0, 0), (write_fields_4, 1), (write_fields_8, 2)):
        for lane, mask in ((types.NoneType, MaskType), (types.Integer, types.Boolean)):
            for places in (types.NestedArray, types.UniTuple):
                typed(writer, types.none, lane, types.Array, places, mask, types.UniTuple)(_write_fields(part))
    typed(split, single, LanesType)(_split)
    typed(split, single, types.Float)(_repeat)
    typed(four, LANES, types.NoneType, *[types.Float] * WIDTH)(_four)
    typed(four, types.float64, types.Integer, *[types.Float] * WIDTH)(_four)
    typed(load, LANES, types.NoneType, types.NestedArray)(_load)
    typed(load, types.float64, types.Integer, types.NestedArray)(_load)
    typed(store, types.none, types.NoneType, types.NestedArray, LanesType)(_store)
    typed(store, types.none, types.Integer, types.NestedArray, types.Float)(_store)


_define_all()
_define_select()
_define_memory()
