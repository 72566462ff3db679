"""Nothing that is read is ever run: the source is searched for whatever turns data into code or commands."""

import ast
from collections.abc import Iterable, Iterator

import pytest

from tests.plan.figures import read_package

MODULES = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "yaml", "ctypes"}
MODULES |= {"code", "codeop", "runpy", "tarfile", "zipfile", "xml", "telnetlib", "urllib", "http", "ftplib", "socket"}
CALLS = {"eval", "exec", "compile", "__import__", "os.system", "popen", "execv", "execve", "spawnl", "fromfile"}
CALLS |= {"read_pickle", "subprocess.run", "subprocess.Popen", "subprocess.call", "subprocess.check_output"}
FLAGS = {"shell", "allow_pickle"}

EXCEPTIONS = {
    "bench/registry.py: subprocess.run": "measures how long `blocksim --help` takes to start: its own fixed command",
    "kernels/common/jit.py: pickle": "machine code, as numba keeps it: from a cache folder of this user",
    "simulation/stores/hdf5.py: ctypes": "keeps a file that could not be written from being closed: no data",
    "study/live.py: subprocess.Popen": "starts the page of --live: this program, the folder of the run",
    "view/animation.py: subprocess.run": "asks the ffmpeg on the PATH which encoders it has: a fixed command",
    "view/animation.py: subprocess.Popen": "gives pixels to the ffmpeg on the PATH: fixed options, its path",
}
"""Places that may do it, and why no data of others reach them. Not in our source, and so not found here: processes of a
sweep, and Dask with --scheduler, pass scenarios between each other with pickle. Nothing of this reads what comes with
scenarios, tables or results."""


def _name(node: ast.expr) -> str:
    return (
        f"{_name(node.value)}.{node.attr}".lstrip(".") if isinstance(node, ast.Attribute) else getattr(node, "id", "")
    )


def _finds(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Yield what a module does of all that."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names if name.name.partition(".")[0] in MODULES)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] in MODULES:
            yield str(node.module)
        elif isinstance(node, ast.Call):
            name = _name(node.func)
            if name in CALLS or (name.rpartition(".")[2] in CALLS and name != "re.compile"):
                yield name
            yield from sorted(
                str(word.arg) for word in node.keywords if word.arg in FLAGS and not _is_false(word.value)
            )


def _is_false(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is False


def test_no_data_become_code_or_commands() -> None:
    found = {f"{module.path}: {one}" for module in read_package() for one in _finds(module.nodes)}
    assert found == set(EXCEPTIONS)


@pytest.mark.parametrize(
    "source",
    [
        "import pickle",
        "from yaml import safe_load",
        "import xml.etree.ElementTree",
        "eval('1')",
        "exec(text)",
        "numpy.load(path, allow_pickle=True)",
        "subprocess.run(command, shell=True)",
        "os.system(text)",
        "pandas.read_pickle(path)",
        "__import__(name)",
    ],
)
def test_the_search_finds_what_it_looks_for(source: str) -> None:
    assert list(_finds(ast.walk(ast.parse(source))))
