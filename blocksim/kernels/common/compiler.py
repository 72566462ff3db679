"""How kernels are compiled, and all private parts of numba and llvmlite that this takes; no other module uses any.

numba makes machine code of every function, though that of an inner one is never run: its callers link its LLVM code
into their own and optimise all of it again, once for every level of calls. Here an inner function is simplified alone,
linked into its callers and kept as LLVM code; only what Python calls becomes machine code, optimised in full. That
halves the processor time of a first run, and changes no bit: no pass may reorder arithmetic.

Shortcuts through numba while many kernels are compiled: the same code, in less time. Most of the time numba and
llvmlite compute what they have computed before: how an operator acts on two numbers, the hash of a type with hundreds
of fields, the size of a structure. And names of functions spell out the types of all arguments, 20 kB each for a scene,
in every module that calls them: here they have a digest of that.

Each part is taken by `private`, which says so where the installed numba lacks it:

| part | for |
| --- | --- |
| numba.core.codegen JITCodeLibrary | base of a library that is kept as LLVM code, without machine code |
| numba.core.compiler Compiler | base of the compilers of inner functions |
| numba.core.compiler CompileResult | a compiled function from what was kept of it, and back |
| numba.core.compiler_machinery PassManager | the list of passes of kernels |
| numba.core.untyped_passes, numba.core.typed_passes | the passes themselves |
| numba.core.caching FunctionCache | base of the cache with checksums (jit.py) |
| numba.core.registry CPUDispatcher | base of the dispatcher that compiles an inner function once (jit.py) |
| numba.core.registry cpu_target | processor and features that machine code is made for |
| numba.core.serialize dumps | compiled functions as bytes (jit.py) |
| numba.np.linalg, numba.np.arraymath ensure_blas | not called as array functions are imported: it takes scipy.linalg |
| numba.core.cgutils | tuples and declarations in generated code (simd.py) |
| numba.core.typing.templates AbstractTemplate, infer_global, signature | types of functions of lanes (simd.py) |
| numba.core.event install_timer | shortcut: no timer for every level of calls |
| numba.core.funcdesc default_mangler | shortcut: short names of functions |
| numba.core.itanium_mangler mangle | the short names themselves |
| numba.core.types.abstract Type | shortcut: hashes of types, each once |
| numba.core.types.functions BaseFunction | shortcut: calls of operators and functions resolved, each once |
| numba.core.base BaseContext | shortcut: sizes of structures, each once |
| numba.core.targetconfig TargetConfig, ConfigStack | shortcut: sets of options compared by their values |
| llvmlite.binding | LLVM code read back; shortcut: triple and name of the processor, each once |
| llvmlite.ir | instructions of lanes and barriers (simd.py, barrier.py) |
"""

import contextlib
import functools
import gc
import hashlib
import importlib
import os
from collections.abc import Callable, Iterator
from importlib import metadata
from typing import Any

PLAIN = os.environ.get("BLOCKSIM_PLAIN_NUMBA") == "1"
"""Kernels are compiled as numba does by itself: without libraries, compilers, cache and shortcuts of this module."""
NEEDED = ("numba.core.cgutils", "numba.core.typing.templates", "llvmlite.ir")  # by any code with lanes and barriers
VERSIONS = " ".join(f"{name} {metadata.version(name)}" for name in ("numba", "llvmlite", "numpy"))


def private(module: str, name: str = "", *members: str) -> Any:
    """Return a module of numba or llvmlite, or what it calls `name`, which has to have some `members`.

    Raises ImportError that names what is missing, and the versions that blocksim was tried with; not where plain numba
    does without it.
    """
    whole = missing = f"{module}.{name}".rstrip(".")
    try:
        part: Any = importlib.import_module(module)
        part = getattr(part, name) if name else part
        for one in members:
            missing = f"{whole}.{one}"
            getattr(part, one)
    except (ImportError, AttributeError) as error:
        if PLAIN and module not in NEEDED:
            return type(name, (), {})
        tried = "the numba that blocksim names"
        with contextlib.suppress(metadata.PackageNotFoundError):
            tried = next((one for one in metadata.requires("blocksim") or () if one.startswith("numba")), tried)
        message = f"{missing} is missing from {VERSIONS}, and blocksim compiles kernels with it; install {tried}"
        message += "" if module in NEEDED else ", or set BLOCKSIM_PLAIN_NUMBA=1, which compiles longer"
        raise ImportError(message) from error
    return part


LIBRARY = "codegen get_pointer_to_function serialize_using_object_code _ensure_finalized _optimize_final_module "
LIBRARY += "_finalize_final_module _finalize_dynamic_globals _verify_declare_only_symbols _get_module_for_linking"
CodeLibrary: Any = private("numba.core.codegen", "JITCodeLibrary", *LIBRARY.split())
Compiler: Any = private("numba.core.compiler", "Compiler", "define_pipelines")
CompileResult: Any = private("numba.core.compiler", "CompileResult", "_rebuild", "_reduce")
PassManager = private("numba.core.compiler_machinery", "PassManager", "add_pass", "finalize")
untyped_passes = private("numba.core.untyped_passes")
typed_passes = private("numba.core.typed_passes")
FunctionCache: Any = private("numba.core.caching", "FunctionCache", "_index_key", "load_overload", "save_overload")
CPUDispatcher: Any = private("numba.core.registry", "CPUDispatcher", "get_call_template")
cpu_target = private("numba.core.registry", "cpu_target", "target_context")
dumps = private("numba.core.serialize", "dumps")
cgutils = private("numba.core.cgutils", "", "get_or_insert_function", "unpack_tuple")
AbstractTemplate: Any = private("numba.core.typing.templates", "AbstractTemplate")
infer_global = private("numba.core.typing.templates", "infer_global")
signature = private("numba.core.typing.templates", "signature")
event = private("numba.core.event", "", "install_timer")
funcdesc = private("numba.core.funcdesc", "", "default_mangler")
mangle = private("numba.core.itanium_mangler", "mangle")
Type = private("numba.core.types.abstract", "Type", "__hash__")
BaseFunction = private("numba.core.types.functions", "BaseFunction", "get_call_type")
BaseContext = private("numba.core.base", "BaseContext", "get_abi_sizeof")
TargetConfig = private("numba.core.targetconfig", "TargetConfig", "values")
ConfigStack = private("numba.core.targetconfig", "ConfigStack", "top_or_none")
binding = private("llvmlite.binding", "", "parse_bitcode", "get_process_triple", "get_host_cpu_name")
ir = private("llvmlite.ir")


@functools.cache
def import_array_functions() -> None:
    """Have numba import its array functions without scipy.linalg, which takes a tenth of a short run.

    They import it only to see that there is a BLAS; whoever compiles a function that calls one has it imported then.
    """
    if PLAIN:
        return
    linalg = private("numba.np.linalg", "", "ensure_blas")
    ensure_blas = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        array_functions = private("numba.np.arraymath", "", "ensure_blas")
    finally:
        linalg.ensure_blas = ensure_blas
    array_functions.ensure_blas = ensure_blas


NAME_DIGITS = 24


def _short_name(name: str, kinds: Any, *, abi_tags: Any = (), uid: Any = None) -> str:
    """Return the name of a compiled function, with a digest of the types of its arguments."""
    spelled = ",".join(str(kind) for kind in kinds)
    digest = hashlib.sha256(spelled.encode()).hexdigest()[:NAME_DIGITS]
    return str(mangle(name, (f"t{digest}",), abi_tags=abi_tags, uid=uid))


def _known_hashes(original: Callable[[Any], int]) -> Callable[[Any], int]:
    """Return how types are hashed, each once."""
    known: dict[int, tuple[int, Any]] = {}

    def hashed(kind: Any) -> int:
        found = known.get(id(kind))
        if found is None:
            found = known[id(kind)] = (original(kind), kind)  # which keeps it, and its address
        return found[0]

    return hashed


def _known_calls(original: Callable[..., Any]) -> Callable[..., Any]:
    """Return how calls of operators and functions of numba are resolved, each once."""
    known: dict[Any, Any] = {}

    def resolved(function: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return original(function, context, args, kws)
        key = (id(function), id(context), tuple(args), ConfigStack.top_or_none())
        found = known.get(key)
        if found is None:
            found = known[key] = (original(function, context, args, kws), function, context)
        return found[0]

    return resolved


def _known_sizes(original: Callable[..., int]) -> Callable[..., int]:
    """Return how sizes of structures are found, each once: llvmlite has a module parsed for every question."""
    known: dict[tuple[int, str], int] = {}

    def size(context: Any, kind: Any) -> int:
        key = (id(context), str(kind))
        if key not in known:
            known[key] = original(context, kind)
        return known[key]

    return size


def _same_flags(one: Any, other: Any) -> Any:
    """Return True if two sets of options are the same."""
    if type(one) is not type(other):
        return NotImplemented
    return one._values == other._values or one.values() == other.values()  # noqa: SLF001 - numba's own


def _replacements() -> list[tuple[Any, str, Any]]:
    return [
        (event, "install_timer", lambda *_: contextlib.nullcontext()),  # else one more for every level of calls
        (funcdesc, "default_mangler", _short_name),
        (Type, "__hash__", _known_hashes(Type.__hash__)),
        (BaseFunction, "get_call_type", _known_calls(BaseFunction.get_call_type)),
        (BaseContext, "get_abi_sizeof", _known_sizes(BaseContext.get_abi_sizeof)),
        (TargetConfig, "__eq__", _same_flags),
        (TargetConfig, "__hash__", lambda _: 0),  # there are but a few
        (binding, "get_process_triple", functools.cache(binding.get_process_triple)),
        (binding, "get_host_cpu_name", functools.cache(binding.get_host_cpu_name)),
    ]


@contextlib.contextmanager
def shortcuts() -> Iterator[None]:
    """Take all shortcuts."""
    with contextlib.ExitStack() as stack:
        for owner, name, other in _replacements():
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, other)
        yield


PASSES: tuple[Any, ...] = (
    ()
    if PLAIN
    else (
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
)

INNER = "inner"  # how a library is kept that has no machine code


RARELY = 200_000  # objects between two collections of cycles; by default Python looks after every 700


@contextlib.contextmanager
def compiling() -> Iterator[None]:
    """Compile much at a time, in less time.

    Takes the shortcuts above, and has cycles collected rarely, as nearly all that a compiler makes stays.
    Changes no code.
    """
    often = gc.get_threshold()
    gc.set_threshold(RARELY, *often[1:])
    try:
        with contextlib.nullcontext() if PLAIN else shortcuts():
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
    library._final_module = library._shared_module = binding.parse_bitcode(bitcode)  # noqa: SLF001 - numba's own
    library._finalize_final_module()  # noqa: SLF001 - as numba does
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
        passes = PassManager("kernel")
        for one in PASSES:
            passes.add_pass(one, one.name())
        passes.finalize()
        return [passes]


def rebuilt(target: Any, parts: tuple[Any, ...]) -> Any:
    """Return a compiled function from what was kept of it, as numba's own `_rebuild` does for machine code."""
    (name, kind, data), *others = parts
    if kind != INNER:
        return CompileResult._rebuild(target, *parts)  # noqa: SLF001 - as numba does
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
