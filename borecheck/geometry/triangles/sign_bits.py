"""On which side of 64 planes does each point lie? Sixty-four answers in one word.

`plane_signs` is the inner loop of the all-pairs kernel. Plain numba does not form
bit masks from vector comparisons, so it is written as LLVM vector instructions
(`<16 x float>` compares become AVX-512 masks, or movemask with AVX2). Where that
cannot be built, `plane_signs_plain` gives the same words more slowly.
"""

from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils as _cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel

cgutils: Any = _cgutils  # carries no types

PLANES = 64  # bits in a word
LANES = 16  # planes per vector instruction
AT_ONCE = 4  # vectors of planes held in registers while the points pass by

Words = NDArray[np.uint64]
Floats = NDArray[np.float32]


@kernel
def plane_signs_plain(
    planes: Floats,
    x: Floats,
    y: Floats,
    z: Floats,
    count: int,
    band: np.float32,
    above: Words,
    below: Words,
) -> None:
    """Writes, for point i, the planes it is surely above and surely below.

    Args:
        planes: Normal and offset of 64 planes, (4, 64).
        x: First coordinates of the points; `y`, `z` the others.
        y: As x.
        z: As x.
        count: How many points.
        band: Half width of the dead band: closer than that is neither.
        above: Result; bit k of above[i]: n_k . p_i + d_k > band.
        below: Result; bit k of below[i]: n_k . p_i + d_k < -band.
    """
    for i in range(count):
        up, down = np.uint64(0), np.uint64(0)
        for k in range(PLANES):
            side = planes[2, k] * z[i] + planes[3, k]
            side = planes[0, k] * x[i] + (planes[1, k] * y[i] + side)
            bit = np.uint64(1) << np.uint64(k)
            up |= bit if side > band else np.uint64(0)
            down |= bit if side < -band else np.uint64(0)
        above[i] = up
        below[i] = down


def _type_plane_signs(
    context: Any,
    planes: Any,
    x: Any,
    y: Any,
    z: Any,
    count: Any,
    band: Any,
    above: Any,
    below: Any,
) -> Any:
    """As `plane_signs_plain`, as vector instructions (C-contiguous arrays only)."""
    signature = types.void(planes, x, y, z, count, band, above, below)
    return signature, _generate


plane_signs_vector: Any = intrinsic(_type_plane_signs)


def _type_lowest_bit(context: Any, word: Any) -> Any:
    """Index of the lowest set bit of a word that is not 0."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        from llvmlite import ir

        flag = ir.Constant(ir.IntType(1), 1)
        return builder.cttz(args[0], flag)

    return types.int64(types.uint64), generate


lowest_bit: Any = intrinsic(_type_lowest_bit)


def _generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """The body: for every group of planes, one pass over the points."""
    from llvmlite import ir

    planes, x, y, z, above, below = (
        cgutils.create_struct_proxy(signature.args[k])(context, builder, args[k]).data
        for k in (0, 1, 2, 3, 6, 7)
    )
    vector = ir.VectorType(ir.FloatType(), LANES)
    zero = ir.Constant(vector, [0.0] * LANES)
    band = _splat(builder, args[5])
    minus_band = builder.fsub(zero, band)
    for first in range(0, PLANES // LANES, AT_ONCE):
        groups = range(first, first + AT_ONCE)
        held = {g: _load_planes(builder, planes, g) for g in groups}
        with cgutils.for_range(builder, args[4]) as loop:
            point = [
                _splat(builder, builder.load(builder.gep(axis, [loop.index])))
                for axis in (x, y, z)
            ]
            up = down = ir.Constant(ir.IntType(64), 0)
            for group in groups:
                side = _side(builder, held[group], point)
                up = _add_bits(builder, up, ">", side, band, group)
                down = _add_bits(builder, down, "<", side, minus_band, group)
            for word, out in ((up, above), (down, below)):
                target = builder.gep(out, [loop.index])
                kept = builder.or_(word, builder.load(target)) if first else word
                builder.store(kept, target)
    return context.get_dummy_value()


def _splat(builder: Any, scalar: Any) -> Any:
    """The scalar in every lane."""
    from llvmlite import ir

    vector = ir.VectorType(ir.FloatType(), LANES)
    undefined = ir.Constant(vector, ir.Undefined)
    index = ir.IntType(32)
    one = builder.insert_element(undefined, scalar, ir.Constant(index, 0))
    zeros = ir.Constant(ir.VectorType(index, LANES), [0] * LANES)
    return builder.shuffle_vector(one, undefined, zeros)


def _load_planes(builder: Any, planes: Any, group: int) -> list[Any]:
    """Normal x, y, z and offset of one group of planes, a vector each."""
    from llvmlite import ir

    vector = ir.VectorType(ir.FloatType(), LANES)
    rows = []
    for row in range(4):
        offset = ir.Constant(ir.IntType(64), PLANES * row + group * LANES)
        address = builder.bitcast(builder.gep(planes, [offset]), vector.as_pointer())
        rows.append(builder.load(address, align=4))
    return rows


def _side(builder: Any, plane: list[Any], point: list[Any]) -> Any:
    """Distances n . p + d in every lane, three fused multiply-adds."""
    from llvmlite import ir

    vector = plane[0].type
    kind = ir.FunctionType(vector, [vector] * 3)
    name = f"llvm.fma.v{LANES}f32"
    fma = cgutils.get_or_insert_function(builder.module, kind, name)
    side = builder.call(fma, [plane[2], point[2], plane[3]])
    side = builder.call(fma, [plane[1], point[1], side])
    return builder.call(fma, [plane[0], point[0], side])


def _add_bits(
    builder: Any, word: Any, order: str, side: Any, limit: Any, group: int
) -> Any:
    """The word with the outcomes of one comparison at their place."""
    from llvmlite import ir

    outcome = builder.fcmp_ordered(order, side, limit)
    bits = builder.zext(builder.bitcast(outcome, ir.IntType(LANES)), word.type)
    shift = ir.Constant(word.type, group * LANES)
    return builder.or_(word, builder.shl(bits, shift))
