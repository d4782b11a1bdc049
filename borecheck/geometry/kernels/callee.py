"""Kernels that only other kernels call, compiled for those alone.

numba compiles every function as if Python called it: two wrappers that unbox its
arguments, machine code and a cache file of its own, and again all of it inside each
caller. Nine kernels of ten here are called by kernels alone; compiling them like that
took more than half of the time before the first check. So a kernel that is compiled on
behalf of another one keeps only what its caller links in. When Python calls it after
all (a test does), it is compiled once more, whole.

This stands on numba's documented ways (a pipeline with a pass of one's own, flags
against wrappers) and on two of its internals: a library's last steps, which optimise it
and make machine code, and the table of compiled overloads. pyproject.toml pins numba
for them. The supported flags alone save a tenth of the time, this half of it.
"""

from functools import partial
from typing import Any

from numba.core import compiler as _compiler
from numba.core import sigutils as _sigutils
from numba.core.caching import FunctionCache as _FunctionCache
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass as _register_pass
from numba.core.registry import CPUDispatcher as _CPUDispatcher
from numba.core.typed_passes import NativeLowering as _NativeLowering

# carry no types
sigutils: Any = _sigutils
CompilerBase: Any = _compiler.CompilerBase
FunctionCache: Any = _FunctionCache
CPUDispatcher: Any = _CPUDispatcher
NativeLowering: Any = _NativeLowering
register_pass: Any = _register_pass


class Callee:
    """Stands where Python's door to a kernel would: this one has none."""


class KernelDispatcher(CPUDispatcher):  # type: ignore[misc]
    """numba's dispatcher; it knows whether it compiles for Python or a kernel."""

    depth = 0  # kernels that are being compiled, each on behalf of the one before

    def compile(self, sig: Any) -> Any:
        """Compiles for a signature, whole when Python asks and for a caller else."""
        with global_compiler_lock:
            arguments = tuple(sigutils.normalize_signature(sig)[0])
            made = self.overloads.get(arguments)
            if made is not None and KernelDispatcher.depth == 0 and is_callee(made):
                del self.overloads[arguments]
            KernelDispatcher.depth += 1
            try:
                return super().compile(sig)
            finally:
                KernelDispatcher.depth -= 1

    def add_overload(self, result: Any) -> None:
        """Keeps what was compiled; a callee is not in the table for Python's calls."""
        if is_callee(result):
            self.overloads[tuple(result.signature.args)] = result
        else:
            super().add_overload(result)

    def enable_caching(self) -> None:
        """Keeps compiled kernels in files, but for callees."""
        self._cache = _KernelCache(self.py_func)


class _KernelCache(FunctionCache):  # type: ignore[misc]
    def save_overload(self, sig: Any, data: Any) -> None:
        if not is_callee(data):
            super().save_overload(sig, data)


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):  # type: ignore[misc]
    """From numba's IR to LLVM's; of a callee, no farther than its caller needs."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        if KernelDispatcher.depth < 2:
            return bool(super().run_pass(state))
        flags, context = state.flags, state.targetctx
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
        library = context.codegen().create_library(state.func_id.func_qualname)
        library.enable_object_caching()
        library._optimize_final_module = _left_to_the_caller
        library._finalize_final_module = partial(_without_machine_code, library)
        state.library = library
        super().run_pass(state)
        library._ensure_finalized()
        door = Callee()
        context.insert_user_function(door, state.cr.fndesc, [library])
        state.reload_init.extend(library._reload_init)
        state["cr"] = state.cr._replace(cfunc=door)
        return True


class KernelCompiler(CompilerBase):  # type: ignore[misc]
    """numba's pipeline with the lowering above."""

    def define_pipelines(self) -> list[Any]:
        """The passes, in their order."""
        builder: Any = _compiler.DefaultPassBuilder
        manager = builder.define_nopython_pipeline(self.state)
        manager.passes = [
            (_KernelLowering if kind is NativeLowering else kind, text)
            for kind, text in manager.passes
        ]
        manager.finalize()
        return [manager]


def is_callee(result: Any) -> bool:
    """Whether what was compiled can be called by other kernels only."""
    return isinstance(result.entry_point, Callee)


def _left_to_the_caller() -> None:
    """A callee is optimised where it is linked in, once for all of the caller."""


def _without_machine_code(library: Any) -> None:
    """Ends a library where its bitcode is ready to be linked in."""
    library._finalize_dynamic_globals()
    library._finalized = True
