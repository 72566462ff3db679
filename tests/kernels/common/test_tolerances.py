"""Every number that kernels compare with stands in one table, and says who notices where it is wrong."""

import ast
from collections.abc import Iterator
from pathlib import Path

from tests.faults.faults import KERNELS, ROOT, TOLERANCES, places_of_tests, tolerances

KINDS = {"round-off", "smoothing", "calibrated", "cost"}
EXACT = {"explicit/laws.py", "sph/functions.py"}  # powers of laws, and factors of kernels
FACTORS = {0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 18.0, 24.0, 120.0}  # of series, averages and integrals
NUMBERS = ast.Constant | ast.UnaryOp | ast.BinOp


def modules() -> Iterator[tuple[Path, ast.Module]]:
    """Yield the modules of the kernels that may have no tolerance of their own."""
    for path in sorted((ROOT / KERNELS).rglob("*.py")):
        if path != ROOT / TOLERANCES and path.relative_to(ROOT / KERNELS).as_posix() not in EXACT:
            yield path, ast.parse(path.read_text(encoding="utf-8"))


def numbers_in(node: ast.AST) -> list[float]:
    """Return the numbers in a part of a program that are no integers."""
    return [one.value for one in ast.walk(node) if isinstance(one, ast.Constant) and isinstance(one.value, float)]


def test_kernels_have_no_tolerance_beside_the_table() -> None:
    """No constant that is a number with a point, and no literal but factors of formulas."""
    for path, tree in modules():
        for node in tree.body:
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
                names = [one for one in ast.walk(node.value) if isinstance(one, ast.Name)]
                assert names or not numbers_in(node.value), f"{path}:{node.lineno}"
        assert set(numbers_in(tree)) <= FACTORS, path


def test_every_line_of_the_table_is_an_entry_of_a_known_kind() -> None:
    tree = ast.parse((ROOT / TOLERANCES).read_text(encoding="utf-8"))
    entries = tolerances()
    assert [one.targets[0].id for one in tree.body[1:]] == [entry.name for entry in entries]  # type: ignore[attr-defined]
    assert {entry.kind for entry in entries} == KINDS
    for entry in entries:
        assert not entry.relative_to.startswith(("m ", "m/s", "s ")), entry.name


def test_every_number_that_results_depend_on_names_a_test_that_notices() -> None:
    """Of others nothing is known to notice; whether the named tests do is tried by `make faults`."""
    for entry in tolerances():
        assert entry.noticed or entry.kind == "cost" or "Nothing notices:" in entry.comment, entry.name
        for test in entry.noticed.values():
            assert len(places_of_tests().get(test, [])) == 1, test
