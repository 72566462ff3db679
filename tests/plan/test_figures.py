"""No figure of the plan of the package exceeds its limit, and private parts of numba are taken in one module."""

import ast
from collections.abc import Iterator

import pytest

from blocksim.kernels.common import compiler
from tests.plan.figures import Module, measure, read_limits, read_package


def test_no_figure_of_the_plan_exceeds_its_limit() -> None:
    figures = measure(read_package())
    assert {name: figures[name] for name, limit in read_limits().items() if figures[name] > limit} == {}


HOME = "kernels/common/compiler.py"
PUBLIC = ("numba.config", "numba.types", "numba.njit", "numba.extending.")
MODULES = {one.path: one for one in read_package()}


def parts_of(module: Module) -> Iterator[str]:
    """Yield what a module imports of numba and llvmlite."""
    for node in module.nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith(("numba.", "llvmlite")))
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in {"numba", "llvmlite"}:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_no_other_module_imports_private_parts() -> None:
    found = {path: [part for part in parts_of(one) if not part.startswith(PUBLIC)] for path, one in MODULES.items()}
    assert {path: parts for path, parts in found.items() if parts} == {}
    assert [path for path, one in MODULES.items() if "import_module(" in one.text and '"numba' in one.text] == [HOME]


def test_every_private_part_is_listed_with_its_purpose() -> None:
    rows = [line for line in (compiler.__doc__ or "").splitlines() if line.startswith("| numba.") or "| llvm" in line]
    calls = [
        [one.value for one in node.args[:2] if isinstance(one, ast.Constant)]
        for node in MODULES[HOME].nodes
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "private"
    ]
    assert len(calls) > 20
    unlisted = [call for call in calls if not any(all(str(word) in row for word in call) for row in rows)]
    assert unlisted == []


@pytest.mark.parametrize(
    ("arguments", "missing"),
    [
        (("numba.core.gone",), "numba.core.gone"),
        (("numba.core.codegen", "Gone"), r"numba.core.codegen.Gone"),
        (("numba.core.codegen", "JITCodeLibrary", "codegen", "_gone"), "numba.core.codegen.JITCodeLibrary._gone"),
    ],
)
def test_missing_part_is_named_with_the_versions_to_install(arguments: tuple[str, ...], missing: str) -> None:
    with pytest.raises(ImportError, match=rf"^{missing} is missing from numba \d.*; install numba"):
        compiler.private(*arguments)


def test_plain_numba_does_without_what_is_missing_except_for_lanes_and_barriers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.raises(ImportError, match="or set BLOCKSIM_PLAIN_NUMBA=1"):
        compiler.private("numba.core.gone", "Gone")
    monkeypatch.setattr(compiler, "PLAIN", True)
    assert issubclass(compiler.private("numba.core.gone", "Gone"), object)
    with pytest.raises(ImportError, match=r"install numba\S*$"):
        compiler.private("llvmlite.ir", "Gone")
