"""Sums of edge intensities along two neighbouring segments for two trial shifts of their common key point.

This is the inner loop of the matching: eight contour points in one vector. Written as the compiler's vector
instructions, since it does not find them in a loop whose loads depend on computed addresses: a third of the time.
Processors that read eight scattered numbers fast do that too in one instruction, in another third less.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import binding, ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 4
"""Compared contour points of a segment; shorter segments are filled up with points in the margin, which is 0."""
FIELDS = 6
PX, PY, NX, NY, FRACTION, BASE = range(FIELDS)
"""Rows of the lanes: positions in the edge images, normals, fraction of the later key point, start of the direction."""

_BYTE, _INT, _LONG, _FLOAT = ir.IntType(8), ir.IntType(32), ir.IntType(64), ir.FloatType()
_FLOATS, _INTS = ir.VectorType(_FLOAT, 2 * LANES), ir.VectorType(_INT, 2 * LANES)
_FLAGS = ("contract",)

Sums = Callable[[Any, Any, Any, Any], list[Any]]


def _pair(builder: Any, first: Any, second: Any) -> Any:
    """A vector of LANES times one number, then LANES times another."""
    empty = ir.Constant(_FLOATS, ir.Undefined)
    a = builder.insert_element(empty, first, ir.Constant(_INT, 0))
    b = builder.insert_element(empty, second, ir.Constant(_INT, 0))
    return builder.shuffle_vector(a, b, ir.Constant(_INTS, [0] * LANES + [2 * LANES] * LANES))


def _fields(context: Any, builder: Any, array_type: Any, lanes: Any, slot: Any) -> list[Any]:
    """The six fields of the segments at `slot` and after it, a vector each."""
    array = context.make_array(array_type)(context, builder, lanes)
    row_bytes = builder.extract_value(array.strides, 0)
    first = builder.add(builder.ptrtoint(array.data, _LONG), builder.mul(slot, ir.Constant(_LONG, 4 * LANES)))
    vectors = []
    for field in range(FIELDS):
        address = builder.add(first, builder.mul(row_bytes, ir.Constant(_LONG, field)))
        vector = builder.load(builder.inttoptr(address, _FLOATS.as_pointer()))
        vector.align = 4
        vectors.append(vector)
    return vectors


def _sums_of_loaded(builder: Any, data: Any, up: Any, down: Any) -> list[Any]:
    """The bytes at both vectors of addresses, loaded one by one, summed over either half of each."""
    sums = []
    for addresses in (up, down):
        for half in range(2):
            total = ir.Constant(_INT, 0)
            for lane in range(half * LANES, (half + 1) * LANES):
                address = builder.zext(builder.extract_element(addresses, ir.Constant(_INT, lane)), _LONG)
                total = builder.add(total, builder.zext(builder.load(builder.gep(data, [address])), _INT))
            sums.append(total)
    return sums


def _sums_of_gathered(builder: Any, data: Any, up: Any, down: Any) -> list[Any]:
    """The same with vectors of loads. A sum of a few bytes fits in half a number: both moves are summed at once."""
    lower, shift = ir.Constant(_INT, 0xFFFF), ir.Constant(_INT, 16)
    moved = builder.shl(_gathered(builder, data, down), ir.Constant(_INTS, [16] * (2 * LANES)))
    both, width = builder.or_(_gathered(builder, data, up), moved), LANES
    while width > 1:  # each half is folded onto itself
        width //= 2
        empty, kind = ir.Constant(both.type, ir.Undefined), ir.VectorType(_INT, 2 * width)
        folds = [[2 * width * half + width * part + i for half in range(2) for i in range(width)] for part in range(2)]
        parts = [builder.shuffle_vector(both, empty, ir.Constant(kind, lanes)) for lanes in folds]
        both = builder.add(*parts)
    halves = [builder.extract_element(both, ir.Constant(_INT, half)) for half in range(2)]
    return [builder.and_(total, lower) for total in halves] + [builder.lshr(total, shift) for total in halves]


def _gathered(builder: Any, data: Any, addresses: Any) -> Any:
    """The bytes at the addresses as numbers. Each is read with the three after it, which the margin has."""
    pointers = builder.gep(data, [addresses], source_etype=_BYTE)
    pointers.type = ir.VectorType(data.type, 2 * LANES)
    flags = ir.VectorType(ir.IntType(1), 2 * LANES)
    kind = ir.FunctionType(_INTS, [pointers.type, _INT, flags, _INTS])
    name = f"llvm.masked.gather.v{2 * LANES}i32.v{2 * LANES}p0"
    gather: Any = cgutils.get_or_insert_function(builder.module, kind, name)  # type: ignore[no-untyped-call]
    every, none = ir.Constant(flags, [1] * (2 * LANES)), ir.Constant(_INTS, None)
    words = builder.call(gather, [pointers, ir.Constant(_INT, 1), every, none])
    return builder.and_(words, ir.Constant(_INTS, [0xFF] * (2 * LANES)))


def _generated(context: Any, builder: Any, signature: Any, arguments: Any, sums: Sums) -> Any:
    images, lanes, slot, left, here, right, step, stride = arguments
    data = context.make_array(signature.args[0])(context, builder, images).data
    px, py, nx, ny, fraction, base = _fields(context, builder, signature.args[1], lanes, slot)

    def add(a: Any, b: Any) -> Any:
        return builder.fadd(a, b, _FLAGS)

    def times(a: Any, b: Any) -> Any:
        return builder.fmul(a, b, _FLAGS)

    def whole(a: Any) -> Any:
        return builder.sitofp(builder.fptosi(a, _INTS), _FLOATS)

    # The common key point is the later one of the first segment and the earlier one of the second.
    rest = builder.fsub(_pair(builder, ir.Constant(_FLOAT, 1.0), ir.Constant(_FLOAT, 1.0)), fraction)
    second = list(range(LANES)) + list(range(3 * LANES, 4 * LANES))
    weight = builder.shuffle_vector(fraction, rest, ir.Constant(_INTS, second))
    others = _pair(builder, left, right)
    shift = add(others, times(weight, builder.fsub(_pair(builder, here, here), others)))
    x, y = add(px, times(shift, nx)), add(py, times(shift, ny))
    change = times(weight, _pair(builder, step, step))
    dx, dy = times(change, nx), times(change, ny)
    row = _pair(builder, stride, stride)
    pointers = [
        builder.fptosi(add(add(times(whole(move(y, dy)), row), whole(move(x, dx))), base), _INTS)
        for move in (builder.fadd, builder.fsub)
    ]
    return context.make_tuple(builder, signature.return_type, sums(builder, data, *pointers))


def _intrinsic(sums: Sums) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _generated(context, builder, signature, arguments, sums)

    def typed(
        typing: Any, images: Any, lanes: Any, slot: Any, left: Any, here: Any, right: Any, step: Any, stride: Any
    ) -> Any:
        arguments = (images, lanes, types.int64, *([types.float32] * 5))
        four: Any = types.UniTuple(types.int32, 4)  # type: ignore[no-untyped-call]
        return four(*arguments), generate

    return intrinsic(typed)


def gathers_fast() -> bool:
    """Whether this processor reads scattered numbers faster in one instruction: Intel's do since 2021.

    Those before are slowed down by the mitigation of a defect, AMD's do it in small steps.
    """
    return bool(binding.get_host_cpu_features().get("avxvnni")) and "znver" not in binding.get_host_cpu_name()


trial_sums_loaded, trial_sums_gathered = _intrinsic(_sums_of_loaded), _intrinsic(_sums_of_gathered)
trial_sums: Any = trial_sums_gathered if gathers_fast() else trial_sums_loaded
"""trial_sums(images, lanes, slot, left, here, right, step, stride): sums of `images` along the segments `slot` and
`slot + 1`, with their common key point at here + step and at here - step.

images: uint8, flat; lanes: float32, (FIELDS, slots LANES); slot: int64; shifts of the key points before, between and
after the two segments, step, and length of a row: float32. Gives four int32: first and second segment at here + step,
then at here - step. Places are cut to whole numbers and must lie within the images.
"""
