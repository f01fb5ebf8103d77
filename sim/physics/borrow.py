"""Arrays without their owner, for a compiled loop that calls many kernels.

Compiled code counts a reference to every array it passes on, one atomic addition each; the plant
and its scratch are more than a hundred arrays. The caller of the loop holds them all for as long as
it runs, so inside the loop nothing needs to be counted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

Arrays = TypeVar("Arrays")


def _disown(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Clear the owner of an array, or of every array in a tuple, however deep."""
    if isinstance(kind, types.Array):
        view = context.make_array(kind)(context, builder, value=value)
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        return view._getvalue()
    if isinstance(kind, types.BaseTuple):
        parts = [
            _disown(context, builder, part, builder.extract_value(value, i))
            for i, part in enumerate(kind)
        ]
        return context.make_tuple(builder, kind, parts)
    return value


def _borrow(typing_context: Any, arrays: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _disown(context, builder, signature.args[0], values[0])

    return arrays(arrays), generate


borrow = cast(Callable[[Arrays], Arrays], intrinsic(_borrow))
"""The same arrays, uncounted. For compiled code; they must not outlive the call's arguments."""
