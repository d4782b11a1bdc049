"""The decorator of every kernel: how numba compiles and keeps it.

    @kernel
    def squared(x: float) -> float:
        return x * x

Importing this module sets numba up first (`blas`, `cache`), so that no kernel can be
compiled without it.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, overload

from numba import njit
from numba.core.dispatcher import Dispatcher

import borecheck.geometry.kernels.blas  # noqa: F401  (for its effect)
from borecheck.geometry.kernels.callee import KernelCompiler, KernelDispatcher

# A kernel holds no Python object (nogil), and divides as numpy does: no exceptions.
_ALWAYS: dict[str, Any] = {
    **{"nogil": True, "error_model": "numpy"},
    "no_cfunc_wrapper": True,  # for callbacks from C, of which there are none
}

# Worth it for small functions in inner loops.
INLINE: dict[str, Any] = {"forceinline": True}
# Only box arithmetic may contract a * b + c: one rounding less, covered by the slack.
BOX: dict[str, Any] = {**INLINE, "fastmath": {"contract"}}


@overload
def kernel(function: Callable[..., Any], /) -> Any: ...
@overload
def kernel(**options: Any) -> Callable[[Callable[..., Any]], Any]: ...
def kernel(function: Callable[..., Any] | None = None, /, **options: Any) -> Any:
    """Makes a function a kernel: `@kernel`, or `@kernel(**INLINE)` with options.

    Args:
        function: What is decorated, when no option is given.
        **options: More of `numba.njit`'s: `**INLINE`, `**BOX`, `inline="always"`.

    Returns:
        numba's dispatcher, or the decorator that makes it.
    """
    if function is None:
        return partial(kernel, **options)
    made: Any = njit(pipeline_class=KernelCompiler, **{**_ALWAYS, **options})(function)
    if isinstance(made, Dispatcher):  # else numba is switched off: NUMBA_DISABLE_JIT
        made.__class__ = KernelDispatcher
        made.enable_caching()
    return made
