"""Sets numba up for the project's kernels; imported for its effect, before any kernel.

It keeps compiled kernels where `kernels.cache` says, and does not import SciPy's BLAS.
When numba compiles or loads its first kernel it looks for `scipy.linalg.cython_blas`,
only to know whether np.cov and np.corrcoef can be compiled. That import takes longer
than a whole contact check, and no kernel here needs it. It is hidden while numba looks,
and there again afterwards. A process that has SciPy's BLAS already is left alone.
"""

import sys

from borecheck.geometry.kernels import cache as kernel_cache

_BLAS = "scipy.linalg.cython_blas"


def _look_without_blas() -> None:
    if _BLAS in sys.modules or "numba.np.arraymath" in sys.modules:
        return
    sys.modules[_BLAS] = None  # type: ignore[assignment]  # how to say "not there"
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules[_BLAS]


_look_without_blas()
kernel_cache.use_for_this_package()
