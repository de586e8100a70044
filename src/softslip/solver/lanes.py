"""Eight numbers at once: the vectors of the processor as a type of compiled functions.

The compiler makes vectors of simple loops only. Loops over pairs of nodes, which add to both, are
written with `Lanes` instead: what stands there for a number is eight of them, in one register of
512 bits or in two of 256. Products and sums round as they stand; only `multiply_add` rounds once,
where the processor does so. No result therefore depends on how the compiler arranges a loop.
"""

# mypy: disable-error-code="no-untyped-call, untyped-decorator"
import operator
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from llvmlite import binding, ir
from numba import extending, types
from numba.core import cgutils
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv import Conversion  # type: ignore[attr-defined]
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import models, register_model

WIDTH = 8
"""Numbers in a vector."""

HALF = WIDTH // 2

Lanes = Any
"""Eight numbers, in annotations; nobody but the compiler knows what they can do."""

intrinsic: Callable[[Callable[..., Any]], Callable[..., Any]] = extending.intrinsic

_INT, _WORD, _DOUBLE = ir.IntType(32), ir.IntType(64), ir.DoubleType()
_VECTOR, _HALVES = ir.VectorType(_DOUBLE, WIDTH), ir.VectorType(_DOUBLE, HALF)
_WORDS, _BITS = ir.VectorType(_WORD, WIDTH), ir.VectorType(ir.IntType(1), WIDTH)


def registers() -> set[str]:
    """Return the names of this processor's vector instructions."""
    features = binding.get_host_cpu_features()
    return {name for name, there in features.items() if there and name.startswith("avx")}


class _LanesType(types.Type):
    """Eight double-precision numbers; a single one becomes eight equal ones."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")

    def can_convert_from(self, _: Any, other: types.Type) -> Conversion | None:
        """Say that plain numbers can stand where lanes are wanted."""
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None


class _MaskType(types.Type):
    """Eight truth values."""

    def __init__(self) -> None:
        super().__init__(name="LaneMask")


lanes, lane_mask = _LanesType(), _MaskType()


@register_model(_LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(_MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: types.Type) -> None:
        super().__init__(manager, kind, _BITS)


def _equal(builder: Any, value: Any) -> Any:
    """Return a vector of equal numbers."""
    start = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, _INT(0))
    return builder.shuffle_vector(start, ir.Constant(_VECTOR, ir.Undefined), _chosen([0] * WIDTH))


def _chosen(places: Sequence[int]) -> Any:
    return ir.Constant(ir.VectorType(_INT, len(places)), list(places))


def _from_number(context: Any, builder: Any, kind: Any, _: Any, value: Any) -> Any:
    return _equal(builder, context.cast(builder, value, kind, types.float64))


for _kind in (types.Float, types.Integer):
    lower_cast(_kind, _LanesType)(_from_number)


def _arithmetic(operation: Callable[..., Any], instruction: str) -> None:
    """Give lanes an operation of numbers."""

    class Template(ConcreteTemplate):
        cases: ClassVar = [signature(lanes, lanes, lanes)]

    infer_global(operation)(Template)

    def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
        return getattr(builder, instruction)(*arguments)

    lower_builtin(operation, lanes, lanes)(generate)


for _operation, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _arithmetic(_operation, _name)


def _called(name: str) -> Callable[..., Any]:
    """Return a generator that calls an instruction of the compiler that has a vector form."""

    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(values))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v8f64")
        return builder.call(function, values)

    return generate


@intrinsic
def equal(context: Any, value: Any) -> tuple[Any, Any]:
    """Return eight equal numbers."""
    return lanes(types.float64), lambda _, builder, __, values: _equal(builder, values[0])


@intrinsic
def multiply_add(context: Any, a: Any, b: Any, c: Any) -> tuple[Any, Any]:
    """Return a b + c."""
    return lanes(lanes, lanes, lanes), _called("fmuladd")


@intrinsic
def nearest_integer(context: Any, value: Any) -> tuple[Any, Any]:
    """Return the nearest integers, as numbers."""
    return lanes(lanes), _called("rint")


@intrinsic
def below(context: Any, a: Any, b: Any) -> tuple[Any, Any]:
    """Return where a < b, which what is no number never is."""
    return lane_mask(lanes, lanes), lambda _, builder, __, values: builder.fcmp_ordered(
        "<", *values
    )


@intrinsic
def beyond(context: Any, a: Any, b: Any) -> tuple[Any, Any]:
    """Return where a >= b, which what is no number never is."""
    return lane_mask(lanes, lanes), lambda _, builder, __, values: builder.fcmp_ordered(
        ">=", *values
    )


@intrinsic
def lesser(context: Any, a: Any, b: Any) -> tuple[Any, Any]:
    """Return the lesser number of each lane, b where a is no number."""

    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", *values), *values)

    return lanes(lanes, lanes), generate


@intrinsic
def where(context: Any, mask: Any, a: Any, b: Any) -> tuple[Any, Any]:
    """Return a where the mask holds, b elsewhere."""
    return lanes(lane_mask, lanes, lanes), lambda _, builder, __, values: builder.select(*values)


@intrinsic
def how_many(context: Any, mask: Any) -> tuple[Any, Any]:
    """Return in how many lanes a mask holds."""

    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], ir.IntType(WIDTH))
        return builder.zext(builder.ctpop(bits), _WORD)

    return types.int64(lane_mask), generate


@intrinsic
def exponent_of(context: Any, value: Any) -> tuple[Any, Any]:
    """Return e of positive numbers m 2^e, 1 ≤ m < 2."""

    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        bits = builder.lshr(builder.bitcast(values[0], _WORDS), ir.Constant(_WORDS, [52] * WIDTH))
        # Within 2^52 the integer n is the number 2^52 + n with the bits of n in its mantissa.
        wide = builder.or_(bits, ir.Constant(_WORDS, [0x4330000000000000] * WIDTH))
        offset = ir.Constant(_VECTOR, [float(2**52 + 1023)] * WIDTH)
        return builder.fsub(builder.bitcast(wide, _VECTOR), offset)

    return lanes(lanes), generate


@intrinsic
def mantissa_of(context: Any, value: Any) -> tuple[Any, Any]:
    """Return m of positive numbers m 2^e, 1 ≤ m < 2."""

    def generate(_: Any, builder: Any, __: Any, values: Any) -> Any:
        bits = builder.bitcast(values[0], _WORDS)
        fraction = builder.and_(bits, ir.Constant(_WORDS, [(1 << 52) - 1] * WIDTH))
        one = builder.or_(fraction, ir.Constant(_WORDS, [1023 << 52] * WIDTH))
        return builder.bitcast(one, _VECTOR)

    return lanes(lanes), generate


def _place(context: Any, builder: Any, kind: Any, values: Sequence[Any], vector: Any) -> Any:
    """Return a pointer to a vector in an array, the first value, from the second value on."""
    data = context.make_array(kind)(context, builder, values[0]).data
    return builder.bitcast(builder.gep(data, [values[1]]), vector.as_pointer())


def _loading(size: int, places: Sequence[int]) -> Callable[..., Any]:
    """Return a generator that loads ``size`` numbers and puts them where they are wanted."""
    vector = ir.VectorType(_DOUBLE, size)

    def generate(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        place = _place(context, builder, kinds.args[0], values, vector)
        loaded = builder.load(place, typ=vector, align=8)
        return builder.shuffle_vector(loaded, ir.Constant(vector, ir.Undefined), _chosen(places))

    return generate


@intrinsic
def eight(context: Any, array: Any, start: Any) -> tuple[Any, Any]:
    """Return eight numbers of a contiguous array from a place on."""
    return lanes(array, types.uint64), _loading(WIDTH, range(WIDTH))


@intrinsic
def four_twice(context: Any, array: Any, start: Any) -> tuple[Any, Any]:
    """Return a, b, c, d, a, b, c, d, the four numbers of a contiguous array from a place on."""
    return lanes(array, types.uint64), _loading(HALF, [*range(HALF), *range(HALF)])


@intrinsic
def two_by_four(context: Any, array: Any, start: Any) -> tuple[Any, Any]:
    """Return a, a, a, a, b, b, b, b, the two numbers of a contiguous array from a place on."""
    return lanes(array, types.uint64), _loading(2, [0] * HALF + [1] * HALF)


@intrinsic
def put_eight(context: Any, array: Any, start: Any, value: Any) -> tuple[Any, Any]:
    """Write eight numbers of a contiguous array from a place on."""

    def generate(target: Any, builder: Any, kinds: Any, values: Any) -> Any:
        place = _place(target, builder, kinds.args[0], values, _VECTOR)
        builder.store(values[2], place, align=8)
        return target.get_dummy_value()

    return types.void(array, types.uint64, lanes), generate


@intrinsic
def add_four(context: Any, array: Any, start: Any, value: Any) -> tuple[Any, Any]:
    """Add the sum of both halves to four numbers of a contiguous array from a place on."""

    def generate(target: Any, builder: Any, kinds: Any, values: Any) -> Any:
        nothing = ir.Constant(_VECTOR, ir.Undefined)
        low, high = (
            builder.shuffle_vector(values[2], nothing, _chosen(range(first, first + HALF)))
            for first in (0, HALF)
        )
        place = _place(target, builder, kinds.args[0], values, _HALVES)
        old = builder.load(place, typ=_HALVES, align=8)
        builder.store(builder.fadd(old, builder.fadd(low, high)), place, align=8)
        return target.get_dummy_value()

    return types.void(array, types.uint64, lanes), generate


@intrinsic
def add_two(context: Any, array: Any, start: Any, value: Any) -> tuple[Any, Any]:
    """Add the sum over each half to two numbers of a contiguous array from a place on."""

    def generate(target: Any, builder: Any, kinds: Any, values: Any) -> Any:
        data = target.make_array(kinds.args[0])(target, builder, values[0]).data
        for half in range(2):
            a, b, c, d = (
                builder.extract_element(values[2], _INT(half * HALF + lane)) for lane in range(HALF)
            )
            total = builder.fadd(builder.fadd(a, c), builder.fadd(b, d))
            place = builder.gep(data, [builder.add(values[1], _WORD(half))])
            builder.store(builder.fadd(builder.load(place), total), place)
        return target.get_dummy_value()

    return types.void(array, types.uint64, lanes), generate
