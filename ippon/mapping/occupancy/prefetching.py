"""Requests for the voxels of a block, so that they are in the cache when they are needed.

A block's arrays lie far apart; asked for before its pixels are looked up, they arrive meanwhile.
"""

from typing import Final

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array

_LINE_BYTES: Final = 64
_FOR_WRITING, _SECOND_LEVEL, _DATA = 1, 2, 1


def prefetch_block(values, row):
    """Ask the processor for one row of a (B, 512) array, contiguous; uncompiled it does nothing.

    The row comes into the second level of the cache, on processors whose request for writing has a
    level; the first is too small for a block and its endpoints.
    """


@intrinsic
def _prefetch_row(_, values, row):  # noqa: ARG001, numba passes types by the parameters' names
    size = values.dtype.bitwidth // 8

    def build(context, builder, signature, args):
        data = make_array(signature.args[0])(context, builder, args[0]).data
        first = builder.mul(args[1], ir.Constant(args[1].type, 512))
        flag = ir.IntType(32)
        request = "llvm.prefetch.p0"
        of = ir.FunctionType(ir.VoidType(), [ir.PointerType(), flag, flag, flag])
        ask = builder.module.globals.get(request) or ir.Function(builder.module, of, request)
        for k in range(0, 512, _LINE_BYTES // size):
            at = builder.gep(data, [builder.add(first, ir.Constant(first.type, k))])
            builder.call(ask, [at, flag(_FOR_WRITING), flag(_SECOND_LEVEL), flag(_DATA)])
        return context.get_dummy_value()

    return types.void(values, types.intp), build


@overload(prefetch_block)
def _compile_prefetch_block(values, row):  # noqa: ARG001
    return lambda values, row: _prefetch_row(values, row)  # noqa: PLW0108  # pyright: ignore[reportCallIssue]
