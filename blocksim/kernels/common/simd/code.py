"""The types of four numbers in compiled code, and the machine code of what is done with them.

Types are vector registers; functions and operators are one instruction for four numbers wherever there is one.
"""

import operator
from collections.abc import Callable
from typing import Any

from numba import types
from numba.extending import lower_builtin, models, register_model

from blocksim.kernels.common.compiler import AbstractTemplate, cgutils, infer_global, ir, signature
from blocksim.kernels.common.simd import functions

DOUBLE = ir.DoubleType()
VECTOR = ir.VectorType(DOUBLE, functions.WIDTH)
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
        super().__init__(manager, of, ir.VectorType(ir.IntType(1), functions.WIDTH))


LIKELY = (2000, 1)  # weights of a branch that is to stay one


def _spread(builder: Any, value: Any) -> Any:
    """Return a value as lanes: one number in all of them."""
    if value.type == VECTOR:
        return value
    single = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, INDEX(0))
    return builder.shuffle_vector(
        single, single, ir.Constant(ir.VectorType(INDEX, functions.WIDTH), [0] * functions.WIDTH)
    )


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
        return builder.shuffle_vector(x, y, ir.Constant(ir.VectorType(INDEX, functions.WIDTH), list(places)))

    even = [mixed(four[k], four[k + 1], 0, 4, 2, 6) for k in (0, 2)]
    odd = [mixed(four[k], four[k + 1], 1, 5, 3, 7) for k in (0, 2)]
    low, high = (0, 1, 4, 5), (2, 3, 6, 7)
    return [mixed(*even, *low), mixed(*odd, *low), mixed(*even, *high), mixed(*odd, *high)]


def _one_of(builder: Any, lane: Any, places: list[Any]) -> Any:
    """Return the place in a lane; of a lane that is known the optimization leaves nothing but that."""
    chosen = places[0]
    for k in range(1, functions.WIDTH):
        chosen = builder.select(builder.icmp_signed("==", lane, ir.Constant(lane.type, k)), places[k], chosen)
    return chosen


def _record_pointers(context: Any, builder: Any, signature: Any, arguments: Any, kind: Any) -> list[Any]:
    """Return pointers to the records at all places, or to that at the place of one lane."""
    array, field = signature.args[1:3]
    start = builder.bitcast(context.make_array(array)(context, builder, arguments[1]).data, BYTE.as_pointer())
    if isinstance(field, types.UniTuple):
        places = cgutils.unpack_tuple(builder, arguments[2], functions.WIDTH)
        if signature.args[0] != types.none:
            places = [_one_of(builder, arguments[0], places)]
    else:
        first = context.make_array(field)(context, builder, arguments[2]).data
        lanes = [INDEX(k) for k in range(functions.WIDTH)] if signature.args[0] == types.none else arguments[:1]
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
        numbers = [builder.load(builder.gep(one, [INDEX(functions.WIDTH * part + k)])) for k in range(functions.WIDTH)]
        return context.make_tuple(builder, signature.return_type, numbers)

    return generate


def _write_fields(part: int) -> Callable[..., Any]:
    """Return the code that writes four fields of records, from number 4 `part` on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        mask = arguments[3]
        columns = cgutils.unpack_tuple(builder, arguments[4], functions.WIDTH)
        if signature.args[0] == types.none:
            pointers = _record_pointers(context, builder, signature, arguments, VECTOR)
            for k, four in enumerate(_transposed(builder, columns)):
                with builder.if_then(builder.extract_element(mask, INDEX(k)), likely=True):
                    builder.store(four, builder.gep(pointers[k], [INDEX(part)]), align=ALIGNMENT)
        else:
            (one,) = _record_pointers(context, builder, signature, arguments, DOUBLE)
            with builder.if_then(mask, likely=True):
                for k, column in enumerate(columns):
                    builder.store(column, builder.gep(one, [INDEX(functions.WIDTH * part + k)]))
        return context.get_dummy_value()

    return generate


def _split(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    numbers = [builder.extract_element(arguments[0], INDEX(k)) for k in range(functions.WIDTH)]
    return context.make_tuple(builder, signature.return_type, numbers)


def _repeat(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return context.make_tuple(builder, signature.return_type, functions.WIDTH * list(arguments))


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
    bits = builder.bitcast(mask, ir.IntType(functions.WIDTH))
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
    _define(functions.is_all, types.boolean, _all, (MASK,))
    _define(functions.is_all, types.boolean, lambda _, flag: flag, (types.boolean,))
    _define(operator.neg, LANES, lambda builder, x: builder.fneg(x), (LANES,))
    _define(abs, LANES, _called("llvm.fabs.v4f64", VECTOR), (LANES,))
    _define(functions.root, LANES, _called("llvm.sqrt.v4f64", VECTOR), (LANES,))
    _define(functions.root, types.float64, _called("llvm.sqrt.f64", DOUBLE), (types.float64,))
    _define(functions.spread, LANES, _spread, (types.float64,))
    _two(functions.greater, LANES, _chosen(">"))
    _two(functions.lesser, LANES, _chosen("<"))
    _define(functions.greater, types.float64, _chosen(">"), (types.float64, types.float64))
    _define(functions.lesser, types.float64, _chosen("<"), (types.float64, types.float64))


def _define_select() -> None:
    """Let compiled code choose between lanes, single numbers for all lanes, or single numbers."""

    def choose(builder: Any, mask: Any, yes: Any, no: Any) -> Any:
        return builder.select(mask, _spread(builder, yes), _spread(builder, no))

    one = types.float64
    for function in (functions.select, functions.branch):
        _define(function, LANES, choose, (MASK, LANES, LANES), (MASK, LANES, one), (MASK, one, LANES), (MASK, one, one))
    _define(
        functions.select, one, lambda builder, mask, yes, no: builder.select(mask, yes, no), (types.boolean, one, one)
    )
    _define(functions.branch, one, _branched, (types.boolean, one, one))


def _define_memory() -> None:
    """Let compiled code read and write lanes."""

    def typed(function: Callable[..., Any], result: Any, *kinds: Any) -> Callable[..., Any]:
        def answer(given: tuple[Any, ...]) -> Any:
            fits = len(given) == len(kinds) and all(isinstance(g, k) for g, k in zip(given, kinds, strict=True))
            return result if fits else None

        _declare(function, answer)
        return lower_builtin(function, *kinds)

    columns, single = types.UniTuple(LANES, functions.WIDTH), types.UniTuple(types.float64, functions.WIDTH)
    for function, part in (
        (functions.fields_0, 0),
        (functions.fields_4, 1),
        (functions.fields_8, 2),
        (functions.fields_12, 3),
        (functions.fields_16, 4),
    ):
        typed(function, columns, types.NoneType, types.Array, types.NestedArray)(_read_fields(part))
        typed(function, columns, types.NoneType, types.Array, types.UniTuple)(_read_fields(part))
        typed(function, single, types.Integer, types.Array, types.NestedArray)(_read_fields(part))
        typed(function, single, types.Integer, types.Array, types.UniTuple)(_read_fields(part))
    for writer, part in ((functions.write_fields_0, 0), (functions.write_fields_4, 1), (functions.write_fields_8, 2)):
        for lane, mask in ((types.NoneType, MaskType), (types.Integer, types.Boolean)):
            for places in (types.NestedArray, types.UniTuple):
                typed(writer, types.none, lane, types.Array, places, mask, types.UniTuple)(_write_fields(part))
    typed(functions.split, single, LanesType)(_split)
    typed(functions.split, single, types.Float)(_repeat)
    typed(functions.four, LANES, types.NoneType, *[types.Float] * functions.WIDTH)(_four)
    typed(functions.four, types.float64, types.Integer, *[types.Float] * functions.WIDTH)(_four)
    typed(functions.load, LANES, types.NoneType, types.NestedArray)(_load)
    typed(functions.load, types.float64, types.Integer, types.NestedArray)(_load)
    typed(functions.store, types.none, types.NoneType, types.NestedArray, LanesType)(_store)
    typed(functions.store, types.none, types.Integer, types.NestedArray, types.Float)(_store)


def teach_compiler() -> None:
    """Let compiled code use lanes."""
    _define_all()
    _define_select()
    _define_memory()
