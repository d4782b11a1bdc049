"""Eight child boxes in one go: the box arithmetic as eight-wide vector instructions.

Numba's own vectoriser leaves these loops scalar, at four times the time. Both
instructions take a *probe*: 19 float32 numbers that stand for the box of the other
tree, made once for the eight children (`boxes.set_probe`). LLVM turns the eight
lanes into whatever the processor has. `tree.boxes` says why results are safe.
"""

from typing import Any

from numba import types
from numba.core import cgutils as _cgutils
from numba.extending import intrinsic

from borecheck.geometry.tree.build import ROWS, WIDTH

cgutils: Any = _cgutils  # carries no types

# Columns of a probe: centre of the box in the frame of the opened tree, half extents
# of its bounds there and of itself (all with slack), the rows of the way back into its
# own frame (9), slack.
CENTRE, BOUNDS, OWN, BACK_ROWS, PROBE_SLACK = 0, 3, 6, 9, 18
PROBE_COLUMNS = 19

# Some float32 squares, sums and a root: below 8 * 2**-24; rotations are checked to
# 1e-6, so that lengths in a mesh's frame are those of the world within 2e-6.
SAFE = 1.0 - 1e-5
SMALL = 1e-30


class _Lanes:
    """Eight-lane float32 expressions over one node and one probe."""

    def __init__(self, builder: Any, nodes: Any, node: Any, probe: Any) -> None:
        from llvmlite import ir

        self.ir = ir
        self.builder = builder
        self.probe = probe
        self.vector = ir.VectorType(ir.FloatType(), WIDTH)
        lanes = builder.bitcast(nodes, self.vector.as_pointer())
        first = builder.mul(node, ir.Constant(node.type, ROWS))
        self.first = builder.gep(lanes, [first])

    def rows(self, first: int) -> list[Any]:
        """Three rows of the node."""
        places = [self.ir.Constant(self.ir.IntType(64), first + d) for d in range(3)]
        return [
            self.builder.load(self.builder.gep(self.first, [place]), align=4)
            for place in places
        ]

    def numbers(self, first: int, count: int = 3) -> list[Any]:
        """Numbers of the probe, each in all lanes."""
        return [self._number(column) for column in range(first, first + count)]

    def _number(self, column: int) -> Any:
        place = self.ir.Constant(self.ir.IntType(64), column)
        return self.spread(self.builder.load(self.builder.gep(self.probe, [place])))

    def spread(self, number: Any) -> Any:
        """One number in all lanes."""
        ir, builder = self.ir, self.builder
        undefined = ir.Constant(self.vector, ir.Undefined)
        lane = ir.Constant(ir.IntType(32), 0)
        single = builder.insert_element(undefined, number, lane)
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
        return builder.shuffle_vector(single, undefined, zeros)

    def constant(self, value: float) -> Any:
        return self.ir.Constant(self.vector, [value] * WIDTH)

    def call(self, name: str, *arguments: Any) -> Any:
        kind = self.ir.FunctionType(self.vector, [self.vector] * len(arguments))
        full = f"{name}.v{WIDTH}f32"
        function = self.builder.module.declare_intrinsic(full, (), kind)
        return self.builder.call(function, arguments)

    def abs(self, x: Any) -> Any:
        return self.call("llvm.fabs", x)

    def dot(self, x: list[Any], y: list[Any], start: Any = None) -> Any:
        """Start + x[0] y[0] + x[1] y[1] + ..., contracted where that is quicker."""
        total = start
        for p, q in zip(x, y, strict=True):
            if total is None:
                total = self.builder.fmul(p, q)
            else:
                total = self.call("llvm.fmuladd", p, q, total)
        return total

    def max(self, x: Any, y: Any) -> Any:
        """The larger one; y if either is NaN."""
        return self.builder.select(self.builder.fcmp_ordered(">", x, y), x, y)

    def excesses(self) -> tuple[list[Any], list[Any], list[Any]]:
        """Differences of the centres, and by how much projections keep apart.

        Both three times: along the axes of the opened tree, then of the other one.
        """
        b = self.builder
        centre, bounds = self.numbers(CENTRE), self.numbers(BOUNDS)
        own, back = self.numbers(OWN), self.numbers(BACK_ROWS, 9)
        half = self.rows(3)
        apart = [b.fsub(x, c) for x, c in zip(self.rows(0), centre, strict=True)]
        seen = [self.dot(apart, back[i : i + 3]) for i in (0, 3, 6)]
        differences = [self.abs(d) for d in apart + seen]
        reaches = [b.fadd(s, w) for s, w in zip(half, bounds, strict=True)]
        for i in range(3):
            row = [self.abs(m) for m in back[3 * i : 3 * i + 3]]
            reaches.append(self.dot(half, row, own[i]))
        excesses = [b.fsub(d, r) for d, r in zip(differences, reaches, strict=True)]
        return differences, half, excesses


def _data(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value).data


def _lanes(context: Any, builder: Any, signature: Any, args: Any) -> _Lanes:
    nodes = _data(context, builder, signature.args[0], args[0])
    probe = _data(context, builder, signature.args[2], args[2])
    return _Lanes(builder, nodes, args[1], probe)


def _type_overlap_mask(context: Any, nodes: Any, node: Any, probe: Any) -> Any:
    """Bit i: child box i of a node may meet the box of the probe.

    A box is kept unless a projection is surely apart; a NaN keeps it.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        lanes = _lanes(context, builder, signature, args)
        zero = lanes.constant(0.0)
        _, _, excesses = lanes.excesses()
        kept = None
        for excess in excesses:
            meets = builder.fcmp_unordered("<=", excess, zero)
            kept = meets if kept is None else builder.and_(kept, meets)
        return _bits(lanes, kept)

    return types.int64(nodes, types.int64, probe), generate


def _type_gap_mask(
    context: Any, nodes: Any, node: Any, probe: Any, limit: Any, gaps: Any
) -> Any:
    """Writes gaps[i], a distance that child box i surely keeps from the probe's box.

    Bit i of the result: that gap is below `limit`. The gap is the largest of three: the
    distance of one box from the bounds of the other, in the frame of either, and the
    gap along the line between the centres. Unused slots have infinite gaps.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        lanes = _lanes(context, builder, signature, args)
        gap = _gap(lanes)
        target = _data(context, builder, signature.args[4], args[4])
        place = builder.bitcast(target, lanes.vector.as_pointer())
        builder.store(gap, place, align=4)
        near = builder.fcmp_unordered("<", gap, lanes.spread(args[3]))
        return _bits(lanes, near)

    signature = types.int64(nodes, types.int64, probe, types.float32, gaps)
    return signature, generate


def _gap(lanes: _Lanes) -> Any:
    b = lanes.builder
    zero, (slack,) = lanes.constant(0.0), lanes.numbers(PROBE_SLACK, 1)
    differences, half, excesses = lanes.excesses()
    far = [lanes.max(e, zero) for e in excesses]
    own, other = lanes.dot(far[:3], far[:3]), lanes.dot(far[3:], far[3:])
    root = lanes.call("llvm.sqrt", lanes.max(own, other))
    small = lanes.constant(SMALL)
    square = lanes.dot(differences[:3], differences[:3], small)
    grown = [b.fadd(s, slack) for s in half]
    reach = lanes.dot(differences[:3], grown)
    reach = lanes.dot(differences[3:], lanes.numbers(OWN), reach)
    along = b.fdiv(b.fsub(square, reach), lanes.call("llvm.sqrt", square))
    return b.fmul(lanes.max(along, root), lanes.constant(SAFE))


def _bits(lanes: _Lanes, flags: Any) -> Any:
    """Eight flags as the low bits of an integer."""
    byte, word = lanes.ir.IntType(8), lanes.ir.IntType(64)
    return lanes.builder.zext(lanes.builder.bitcast(flags, byte), word)


overlap_mask: Any = intrinsic(_type_overlap_mask)
gap_mask: Any = intrinsic(_type_gap_mask)


def _type_array_at(context: Any, address: Any) -> Any:
    """An address as a pointer, for `numba.carray`."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), generate


def _type_local_memory(context: Any, size: Any) -> Any:
    """So many bytes that live as long as the function, not set to anything.

    Other than memory from the heap they are known to be nobody else's, so that
    the compiler keeps what lies there in registers.
    """

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        from llvmlite import ir

        kind = ir.ArrayType(ir.VectorType(ir.FloatType(), WIDTH), -(-count // 32))
        place = cgutils.alloca_once(builder, kind)
        return builder.bitcast(place, context.get_value_type(types.voidptr))

    if not isinstance(size, types.IntegerLiteral):
        return None
    count = size.literal_value
    return types.voidptr(size), generate


array_at: Any = intrinsic(_type_array_at)
local_memory: Any = intrinsic(prefer_literal=True)(_type_local_memory)
