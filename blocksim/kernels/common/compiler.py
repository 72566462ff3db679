"""How a kernel that only kernels call is compiled: to what callers inline, and no further.

numba makes machine code of every function, though that of an inner one is never run: its callers link its LLVM code
into their own and optimise all of it again, once for every level of calls. Here an inner function is simplified alone,
linked into its callers and kept as LLVM code; only what Python calls becomes machine code, optimised in full. That
halves the processor time of a first run, and changes no bit: no pass may reorder arithmetic.

This uses private parts of numba, so pyproject.toml names the versions that it was tried with.
"""

import contextlib
import gc
from collections.abc import Iterator
from typing import Any

from llvmlite import binding
from numba.core import codegen, compiler, typed_passes, untyped_passes
from numba.core.compiler_machinery import PassManager

from blocksim.kernels.common.shortcuts import shortcuts

CodeLibrary: Any = codegen.JITCodeLibrary  # these come without type hints
Compiler: Any = compiler.Compiler
CompileResult: Any = compiler.CompileResult
Manager: Any = PassManager

PASSES: tuple[Any, ...] = (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.NoPythonSupportedFeatureValidation,
    typed_passes.IRLegalization,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
)

INNER = "inner"  # how a library is kept that has no machine code


RARELY = 200_000  # objects between two collections of cycles; by default Python looks after every 700


@contextlib.contextmanager
def compiling() -> Iterator[None]:
    """Compile much at a time, in less time.

    Takes the shortcuts of shortcuts.py, and has cycles collected rarely, as nearly all that a compiler makes stays.
    Changes no code.
    """
    often = gc.get_threshold()
    gc.set_threshold(RARELY, *often[1:])
    try:
        with shortcuts():
            yield
    finally:
        gc.set_threshold(*often)


class _NoEnvironment:
    """The code generator of an inner function, which has no machine code that an environment could be given to."""

    def __init__(self, generator: Any) -> None:
        self._generator = generator

    def __getattr__(self, name: str) -> Any:
        return getattr(self._generator, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


class InnerLibrary(CodeLibrary):  # type: ignore[misc]  # Any
    """The LLVM code of one inner function and of all that it calls."""

    @property
    def codegen(self) -> Any:
        """The code generator."""
        return _NoEnvironment(self._codegen)

    def get_pointer_to_function(self, _: str) -> int:
        """Return 0, as for any function that this process cannot call."""
        self._ensure_finalized()
        return 0

    def _optimize_final_module(self) -> None:
        """Do nothing: every caller links the same code again, and what becomes machine code is optimised in the end."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        """Return what is kept on the disk."""
        return self.name, INNER, self._get_module_for_linking().as_bitcode()


def _restored(generator: Any, name: str, bitcode: bytes) -> InnerLibrary:
    library = InnerLibrary(generator, name)
    library._final_module = library._shared_module = binding.parse_bitcode(bitcode)  # noqa: SLF001
    library._finalize_final_module()  # noqa: SLF001
    return library


class InnerCompiler(Compiler):  # type: ignore[misc]  # Any
    """numba's compiler with the library above."""

    def __init__(self, typing: Any, target: Any, library: Any, *more: Any) -> None:
        """Compile into a library of its own, unless one is given."""
        super().__init__(typing, target, library, *more)
        if library is None:
            self.state.library = InnerLibrary(target.codegen(), INNER)
            self.state.library.enable_object_caching()


class LeanCompiler(InnerCompiler):
    """The same for kernels of this package, which have no closures, generators or array expressions."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes that are left."""
        passes = Manager("kernel")
        for one in PASSES:
            passes.add_pass(one, one.name())
        passes.finalize()
        return [passes]


def rebuilt(target: Any, parts: tuple[Any, ...]) -> Any:
    """Return a compiled function from what was kept of it, as numba's own `_rebuild` does for machine code."""
    (name, kind, data), *others = parts
    if kind != INNER:
        return CompileResult._rebuild(target, *parts)  # noqa: SLF001
    fndesc, environment, signature, objectmode, lifted, annotation, reload_init, referenced_envs = others
    library = _restored(target.codegen(), name, data)
    return CompileResult(
        target_context=target,
        typing_context=target.typing_context,
        library=library,
        environment=environment,
        entry_point=target.get_executable(library, fndesc, environment),
        fndesc=fndesc,
        type_annotation=annotation,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
        typing_error=None,
        call_helper=None,
        metadata=None,
        reload_init=reload_init,
        referenced_envs=referenced_envs,
    )
