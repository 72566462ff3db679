"""Compiling the solver before a command needs it, reported in one line: it is not part of a run."""

from blocksim.cli.collector import loading
from blocksim.cli.output import note
from blocksim.kernels import jit
from blocksim.simulation.compilation import compile_kernels, is_compiled


def tell_compilation(kernels: str, *, quiet: bool) -> None:
    """Compile a set of kernels unless that is done, and report it: it is not part of a run."""
    if is_compiled(kernels):
        with loading():
            compile_kernels(kernels)
        return
    if quiet:
        compile_kernels(kernels)
        return
    note("Compiling the solver, once after installation (less than a minute) ...")
    note(f"Compiled in {compile_kernels(kernels):.0f} s.")
    if not is_compiled(kernels):
        folder = jit.cache_folder() or jit.cache_root()
        note(f"{folder}: the compiled solver cannot be stored there; free some space, or set BLOCKSIM_CACHE_DIR")
