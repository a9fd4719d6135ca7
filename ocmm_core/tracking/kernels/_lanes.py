"""Vectors of eight numbers processed by one instruction.

numba has no such type, and vectorises its loops only if LLVM can prove a great deal. `Lanes` is
LLVM's ``<8 x double>``: eight frames in parallel. On a processor with shorter registers LLVM splits
it, so results are the same on all processors. Operations are IEEE 754 on each number, never fused:
a single frame, as plain floats through the same source, gives identical bits.

The functions here accept lanes and floats alike; ``like`` is any value of the wanted kind.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, ClassVar

from llvmlite import ir
from numba.core import types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

WIDTH = 8

Number = Any
"""A float, or lanes: numba compiles the functions for both."""

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_INDEX = ir.IntType(32)


class Lanes(types.Type):
    """Type of eight float64 that are computed together."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")


lanes = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc] # numba has no annotations
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _define(function: Callable[..., Any], build: str) -> None:
    """Define an arithmetic operator of lanes with lanes, and with a scalar float, for numba."""
    pairs = [(lanes, lanes), (lanes, types.float64), (types.float64, lanes)]

    @infer_global(function)
    class Template(ConcreteTemplate):  # type: ignore[misc] # numba has no annotations
        cases: ClassVar[list[Any]] = [signature(lanes, *pair) for pair in pairs]

    for pair in pairs:

        def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            both = [
                _spread(builder, kind, value) for kind, value in zip(sig.args, args, strict=True)
            ]
            return getattr(builder, build)(*both)

        lower_builtin(function, *pair)(lower)


def _spread(builder: Any, kind: Any, value: Any) -> Any:
    """Return a value as a vector, a float in all its places."""
    if kind == lanes:
        return value
    first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, _INDEX(0))
    places = ir.Constant(ir.VectorType(_INDEX, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), places)


for _operator, _build in (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):  # fmt: skip
    _define(_operator, _build)


@intrinsic
def spread(_context: Any, like: Any, value: Any) -> Any:
    """Return a float in all places of a value as ``like``."""

    def build(_context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _spread(builder, sig.args[1], args[1]) if sig.return_type == lanes else args[1]

    return like(like, types.float64), build


@intrinsic
def choose(_context: Any, above: Any, limit: Any, yes: Any, no: Any) -> Any:
    """Return ``yes`` where ``above > limit``, else ``no``; false for NaN."""
    kind = above

    def build(_context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if sig.return_type == lanes:
            args = [_spread(builder, one, value) for one, value in zip(sig.args, args, strict=True)]
        return builder.select(builder.fcmp_ordered(">", args[0], args[1]), args[2], args[3])

    asked = [kind if one == lanes else types.float64 for one in (above, limit, yes, no)]
    return kind(*asked), build


@intrinsic
def any_above(_context: Any, above: Any, limit: Any) -> Any:
    """Return whether ``above > limit`` anywhere."""

    def build(_context: Any, builder: Any, sig: Any, args: Any) -> Any:
        found = builder.fcmp_ordered(">", *args)
        if sig.args[0] != lanes:
            return found
        bits = builder.bitcast(found, ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, bits.type(0))

    return types.boolean(above, above), build


@intrinsic
def load(_context: Any, like: Any, array: Any, row: Any) -> Any:
    """Return ``array[row]``; each row is eight numbers, or one for a float."""

    def build(_context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.load(_address(_context, builder, sig, args), align=8)

    return like(like, array, types.intp), build


@intrinsic
def store(_context: Any, value: Any, array: Any, row: Any) -> Any:
    """Do ``array[row] = value``; see `load`."""

    def build(_context: Any, builder: Any, sig: Any, args: Any) -> Any:
        builder.store(args[0], _address(_context, builder, sig, args), align=8)
        return _context.get_dummy_value()

    return types.void(value, array, types.intp), build


def _address(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Return the address of a row of a contiguous array (n, width); args: value, array, row."""
    kind, array_kind = sig.args[0], sig.args[1]
    data = context.make_array(array_kind)(context, builder, args[1]).data
    width = WIDTH if kind == lanes else 1
    start = builder.gep(data, [builder.mul(args[2], args[2].type(width))])
    return builder.bitcast(start, (_VECTOR if kind == lanes else ir.DoubleType()).as_pointer())


@intrinsic
def eight(_context: Any) -> Any:
    """Return lanes that hold zero."""

    def build(_context: Any, _builder: Any, _sig: Any, _args: Any) -> Any:
        return ir.Constant(_VECTOR, [0.0] * WIDTH)

    return lanes(), build
