"""Mutants: faults made by program and sampled over all rooms; and the matrix of which tests catch what.

    python -m tests.faults.mutants --count 200 --seed 1 [--part 1/4] [--jobs N]
    python -m tests.faults.mutants --faults [--part 1/4] [--jobs N]

The first samples mutants, a room's share being that of its lines of code, and runs each against the tests that reach
its line, the nearest first, until one fails. The second runs every recorded fault against its own tests and the nearest
of others, all of them. Both read what tests.faults.reach has measured, and leave out files that none of it reaches and
what tests/faults/matrix.tsv has already, so that a call goes on where the last one ended.

A line of the matrix: fault or mutant, place, name, caught or survived, and by which tests or for which reason. The
reason for which a mutant survives (equivalent, tolerance, cost) is written there by whoever has looked at it.
"""

import argparse
import ast
import copy
import os
import random
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.faults.examine import Failed, put_in, run_tests
from tests.faults.faults import HERE, ROOT, Fault, faults_in, faults_of_tolerances
from tests.faults.reach import nearest, part_of
from tests.faults.run import pool, say

MATRIX = HERE / "matrix.tsv"
MOST_TESTS = 40  # of those that reach a mutant's line
OTHER_FILES = 8  # of tests that a recorded fault is tried against, beside its own
ENOUGH = 40.0  # s of processor time, after which no further test begins
PATIENCE = 100.0  # s of processor time, after which a test that does not end has failed
COMPARISONS = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq}
COMPARISONS |= {ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}
TURNED = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt}
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult}


@dataclass(frozen=True)
class Mutant:
    """A piece of a source file and what it becomes; columns are those of ast, in bytes."""

    file: str
    node: ast.expr | ast.stmt
    new: str

    def as_fault(self) -> Fault:
        """Return it as a fault of whole lines, as many as are there once."""
        source = (ROOT / self.file).read_text(encoding="utf-8")
        lines = source.splitlines(keepends=True)
        first, last = self.node.lineno - 1, (self.node.end_lineno or 0) - 1
        head = lines[first].encode()[: self.node.col_offset].decode()
        tail = lines[last].encode()[self.node.end_col_offset :].decode()
        old, new = "".join(lines[first : last + 1]), head + self.new + tail
        shown = " ".join((ast.get_source_segment(source, self.node) or "").split())
        name = f"{shown[:60]} -> {' '.join(self.new.split())[:60]}"
        while source.count(old) > 1:
            first -= 1
            old, new = lines[first] + old, lines[first] + new
        return Fault(name, self.file, old, new, tuple(nearest(self.file, self.node.lineno)[:MOST_TESTS]))


def changes(node: ast.AST) -> Iterator[str]:
    """Yield what a node could be by mistake."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        for table in (COMPARISONS, TURNED):
            if type(node.ops[0]) in table:
                yield _changed(node, ops=[table[type(node.ops[0])]()])
    elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS and not isinstance(node.left, ast.JoinedStr):
        yield _changed(node, op=OPERATORS[type(node.op)]())
    elif isinstance(node, ast.BoolOp):
        yield _changed(node, op=ast.And() if isinstance(node.op, ast.Or) else ast.Or())
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield f"({ast.unparse(node.operand)})"
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield str(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        yield from (
            str(node.value + 1),
            str(node.value - 1) if isinstance(node.value, int) else str(2 * node.value or 0.5),
        )
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"min", "max"}:
        yield _changed(node, func=ast.Name("max" if node.func.id == "min" else "min"))
    elif isinstance(node, ast.Return) and node.value is not None:
        yield "return None"
    elif isinstance(node, ast.Assign | ast.AugAssign | ast.Raise | ast.Continue) or (
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    ):
        yield "pass"


def _changed(node: ast.expr, **fields: object) -> str:
    other = copy.copy(node)
    for name, value in fields.items():
        setattr(other, name, value)
    return f"({ast.unparse(other)})"


def nodes(tree: ast.AST, *, inside: bool = False) -> Iterator[ast.AST]:
    """Yield the nodes of all functions; no annotations, no text, and nothing that runs at import."""
    for name, field in ast.iter_fields(tree):
        for child in field if isinstance(field, list) else [field]:
            if not isinstance(child, ast.AST) or isinstance(child, ast.JoinedStr):
                continue
            if name not in {"annotation", "returns", "decorator_list"}:
                if inside:
                    yield child
                yield from nodes(child, inside=inside or (isinstance(tree, ast.FunctionDef) and name == "body"))


def mutants_of(path: Path) -> list[Mutant]:
    """Return all mutants of a source file."""
    file = path.relative_to(ROOT).as_posix()
    every = nodes(ast.parse(path.read_text(encoding="utf-8")))
    return [Mutant(file, node, new) for node in every if isinstance(node, ast.expr | ast.stmt) for new in changes(node)]


def sample(count: int, seed: int) -> list[Mutant]:
    """Return mutants of files drawn by their lines, each file's any with the same chance."""
    chance = random.Random(seed)  # noqa: S311 - not for secrets
    paths = sorted((ROOT / "blocksim").rglob("*.py"))
    lines = [len(path.read_text(encoding="utf-8").splitlines()) for path in paths]
    chosen: dict[tuple[object, ...], Mutant] = {}
    while len(chosen) < count:
        (path,) = chance.choices(paths, lines)
        every = mutants_of(path)
        if every:
            one = chance.choice(every)
            chosen.setdefault((one.file, one.node.lineno, one.node.col_offset, one.new), one)
    return list(chosen.values())


class Enough:
    """Lets no further test begin after some processor time: a plugin of pytest."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> bool | None:  # noqa: ARG002 - pytest's name
        """Return True where a test is passed over."""
        return True if time.process_time() > ENOUGH else None


def line_of(sort: str, place: str, fault: Fault, tests: tuple[str, ...], *, first_only: bool) -> str:
    """Run tests on a fault, in a process that does nothing else; return a line of the matrix."""
    failed = Failed()
    verdict, by = "survived", "not looked at"
    put_in(fault)
    code, printed = run_tests(
        tests, failed, Enough(), interpreted=fault.is_interpreted, first_only=first_only, patience=PATIENCE
    )
    if failed.names or code not in {pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED}:
        functions = dict.fromkeys(one.partition("[")[0].removeprefix("tests/") for one in failed.names)
        last = (printed.replace(f"{ROOT}/", "").strip().splitlines() or [""])[-1]
        verdict, by = "caught", " ".join(functions) or f"at import: {last}"
    return "\t".join([sort, place, fault.name, verdict, " ".join(by.split())])


def tests_of(fault: Fault) -> tuple[str, ...]:
    """Return a recorded fault's own tests and the nearest of others that reach its line, one of a file."""
    before = (ROOT / fault.file).read_text(encoding="utf-8").partition(fault.text)[0]
    line = before.count("\n") + 1 + fault.text.startswith("\n")
    files = {one.partition("::")[0]: one for one in reversed(nearest(fault.file, line))}
    return tuple(dict.fromkeys([*fault.tests, *[*reversed(files.values())][:OTHER_FILES]]))


def main(arguments: Sequence[str]) -> int:
    """Add what is not in the matrix yet; return exit code 1 where a mutant survives that nobody has looked at."""
    parser = argparse.ArgumentParser(description="Sample mutants, or take the faults, and keep which tests catch them.")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--faults", action="store_true", help="the recorded faults, not mutants")
    parser.add_argument("--part", default="1/1")
    parser.add_argument("--only", default="", help="words in the place")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args(arguments)
    known = {tuple(one.split("\t")[:3]) for one in _kept()}
    if asked.faults:
        faults = [fault for fault in [*faults_in(HERE), *faults_of_tolerances()] if not fault.is_stale]
        tried = [("fault", fault.file, fault, tests_of(fault)) for fault in faults]
    else:
        mutants = [
            (f"{one.file}:{one.node.lineno}:{one.node.col_offset}", one.as_fault())
            for one in sample(asked.count, asked.seed)
        ]
        tried = [("mutant", place, fault, fault.tests) for place, fault in mutants]
    mine = [one for one in part_of(tried, asked.part) if asked.only in one[1] and one[3]]
    left = [one for one in mine if (*one[:2], one[2].name) not in known]
    with pool(asked.jobs) as workers:
        waiting = [workers.submit(line_of, *one, first_only=not asked.faults) for one in left]
        for done in as_completed(waiting):
            line = done.result()
            say(line)
            MATRIX.write_text("\n".join(sorted({*_kept(), line})) + "\n", encoding="utf-8")
    return 1 if any(one.endswith("not looked at") for one in _kept()) else 0


def _kept() -> list[str]:
    return MATRIX.read_text(encoding="utf-8").splitlines() if MATRIX.exists() else []


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
