"""make figures: figures of the plan of the package, beside those of a reference commit.

Each figure is a count or a share that grows as a plan decays: lines, files, imports, functions of one statement,
modules that serve a single neighbour, questions that one module should answer for all. A figure may exceed that of the
reference, reference.json, by `ALLOWANCE`; a new reference is written by hand, with the reason in the commit.
"""

import ast
import json
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import permutations
from pathlib import Path

ROOT = Path(__file__).parents[2]
REFERENCE = Path(__file__).with_name("reference.json")
ALLOWANCE = 0.02  # of a figure
SHAPE_QUESTION = re.compile(
    r"\b(?:outlines?|shapes) is (?:not )?None"
    r"|(?:if|not|any\() ?(?:body|one|self|block|bodies\[\w+\])?\.?outlines?\b(?!\.)"
    r"|is_polygon|has_outlines|== OUTLINE\b|!= OUTLINE\b|if outline\b|corner_count > 0"
)
SCHEME_QUESTION = re.compile(
    r"isinstance\([^)]*\b(?:Explicit|Nonsmooth)\b|scheme\s*(?:==|!=)|\bis_rigid\b|\.rigid\b|[\"'](?:nonsmooth|explicit)[\"']"
)
NOQA_ALONE = re.compile(r"# noqa(?!: [A-Z0-9, ]+ - \w)")
MOST_IN_COMMON = 8
OWNERS_OF_SCHEMES = ("simulation/schemes/", "kernels/")
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Module:
    """One Python file of the package."""

    name: str  # dotted
    path: str  # below the package
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        """The syntax tree."""
        return ast.parse(self.text)

    @cached_property
    def nodes(self) -> tuple[ast.AST, ...]:
        """All nodes of the tree."""
        return tuple(ast.walk(self.tree))

    @property
    def folder(self) -> str:
        """The folder below the package."""
        return self.path.rpartition("/")[0]

    @property
    def lines(self) -> int:
        """The number of lines."""
        return self.text.count("\n")

    @property
    def functions(self) -> list[Function]:
        """All functions and methods."""
        return [node for node in self.nodes if isinstance(node, Function)]


@cache
def read_package(root: Path = ROOT) -> list[Module]:
    """Return all modules of blocksim below a checkout."""
    folder = root / "blocksim"
    paths = sorted(folder.rglob("*.py"))
    return [
        Module(
            ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"),
            path.relative_to(folder).as_posix(),
            path.read_text(encoding="utf-8"),
        )
        for path in paths
    ]


def _spans(nodes: Iterator[ast.stmt]) -> int:
    return sum((node.end_lineno or node.lineno) - node.lineno + 1 for node in nodes)


def _docstrings(module: Module) -> Iterator[ast.stmt]:
    for node in module.nodes:
        if isinstance(node, Function | ast.ClassDef | ast.Module) and node.body:
            first = node.body[0]
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                yield first


def import_share(modules: list[Module]) -> float:
    """Return the share of lines that import."""
    imports = (node for one in modules for node in one.nodes if isinstance(node, ast.Import | ast.ImportFrom))
    return _spans(imports) / sum(one.lines for one in modules)


def docstring_share(modules: list[Module]) -> float:
    """Return the share of lines that are docstrings."""
    return _spans(node for one in modules for node in _docstrings(one)) / sum(one.lines for one in modules)


def single_statement_share(modules: list[Module]) -> float:
    """Return the share of functions whose body is a single statement."""
    lengths = [len(node.body) - (ast.get_docstring(node) is not None) for one in modules for node in one.functions]
    return sum(length <= 1 for length in lengths) / len(lengths)


def imported_modules(module: Module, names: set[str]) -> set[str]:
    """Return the modules of the package that a module imports, those of names in them too."""
    found = set()
    for node in module.nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return (found & names) - {module.name}


def one_neighbour(modules: list[Module]) -> list[str]:
    """Return the modules that a single other module imports, one of the same folder."""
    by_name = {one.name: one for one in modules}
    importers = defaultdict(set)
    for one in modules:
        for name in imported_modules(one, set(by_name)):
            importers[name].add(one.name)
    return sorted(
        name
        for name, others in importers.items()
        if len(others) == 1
        and name != "blocksim.cli.app"  # the script `blocksim` imports it too
        and by_name[name].folder == by_name[min(others)].folder
        and "__init__" not in by_name[name].path
    )


def repeated_names(modules: list[Module]) -> list[str]:
    """Return the file names that stand more than once."""
    counts = Counter(one.path.rpartition("/")[2] for one in modules)
    return sorted(name for name, count in counts.items() if count > 1 and name != "__init__.py")


def called_once(modules: list[Module]) -> list[str]:
    """Return the functions of modules whose name is called at a single place of the package."""
    calls = Counter(
        getattr(node.func, "id", getattr(node.func, "attr", ""))
        for one in modules
        for node in one.nodes
        if isinstance(node, ast.Call)
    )
    names = [node.name for one in modules for node in one.tree.body if isinstance(node, Function)]
    return sorted(name for name in names if calls[name] == 1)


def classes_of_one_name(modules: list[Module]) -> list[str]:
    """Return the names of public classes, outside kernels, that stand in more than one module."""
    counts = Counter(
        node.name
        for one in modules
        if not one.path.startswith("kernels/")
        for node in one.nodes
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    return sorted(name for name, count in counts.items() if count > 1)


def repeated_lists(modules: list[Module]) -> list[str]:
    """Return the functions and dataclasses that have more than eight parameters or fields in common with another."""
    lists: dict[str, set[str]] = {}
    for one in modules:
        for node in one.nodes:
            if isinstance(node, Function):
                arguments = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
                lists[f"{one.path}:{node.name}"] = {argument.arg for argument in arguments}
            elif isinstance(node, ast.ClassDef):
                fields = (line.target for line in node.body if isinstance(line, ast.AnnAssign))
                lists[f"{one.path}:{node.name}"] = {field.id for field in fields if isinstance(field, ast.Name)}
    long = {name: names - {"self"} for name, names in lists.items() if len(names) > MOST_IN_COMMON}
    return sorted({one for one, other in permutations(long, 2) if len(long[one] & long[other]) > MOST_IN_COMMON})


def questions(modules: list[Module], pattern: re.Pattern[str], *, outside: tuple[str, ...] = ()) -> list[str]:
    """Return the lines, as path:number, that match a pattern."""
    return [
        f"{one.path}:{number}"
        for one in modules
        if not one.path.startswith(outside)
        for number, line in enumerate(one.text.splitlines(), start=1)
        if pattern.search(line)
    ]


def _count(text: str) -> Callable[[list[Module]], float]:
    return lambda modules: sum(one.text.count(text) for one in modules)


FIGURES: Mapping[str, Callable[[list[Module]], float]] = {
    "lines": lambda modules: sum(one.lines for one in modules),
    "files": len,
    "imports, % of lines": lambda modules: 100.0 * import_share(modules),
    "lines without docstrings, %": lambda modules: 100.0 * (1.0 - docstring_share(modules)),
    "functions": lambda modules: sum(len(one.functions) for one in modules),
    "functions of one statement, %": lambda modules: 100.0 * single_statement_share(modules),
    "functions called once": lambda modules: len(called_once(modules)),
    "modules of one neighbour": lambda modules: len(one_neighbour(modules)),
    "file names used twice": lambda modules: len(repeated_names(modules)),
    "class names used twice": lambda modules: len(classes_of_one_name(modules)),
    "lists of parameters that stand twice": lambda modules: len(repeated_lists(modules)),
    "noqa": _count("# noqa"),
    "noqa without a reason": lambda modules: len(questions(modules, NOQA_ALONE)),
    "lines that ask for the shape": lambda modules: len(questions(modules, SHAPE_QUESTION)),
    "files that ask for the shape": lambda modules: len(
        {place.partition(":")[0] for place in questions(modules, SHAPE_QUESTION)}
    ),
    "lines that ask for the scheme": lambda modules: len(
        questions(modules, SCHEME_QUESTION, outside=OWNERS_OF_SCHEMES)
    ),
}


def measure(modules: list[Module]) -> dict[str, float]:
    """Return all figures, rounded to what is kept."""
    return {name: round(float(figure(modules)), 2) for name, figure in FIGURES.items()}


def read_limits() -> dict[str, float]:
    """Return what no figure may exceed."""
    reference = json.loads(REFERENCE.read_text(encoding="utf-8"))
    granted = reference["granted"]  # by decision: what the retaining walls were worth
    return {name: (1.0 + ALLOWANCE) * value + granted.get(name, 0.0) for name, value in reference["figures"].items()}


def main() -> int:
    """Print figures, those of the reference and limits; exit code 1 where a figure exceeds its limit."""
    reference = json.loads(REFERENCE.read_text(encoding="utf-8"))
    limits = read_limits()
    figures = measure(read_package())
    sys.stdout.write(f"{'':38} {'now':>8} {reference['commit']:>9} {'limit':>9}\n")
    for name, value in figures.items():
        mark = "" if value <= limits[name] else "  exceeded"
        sys.stdout.write(f"{name:38} {value:8g} {reference['figures'][name]:9g} {limits[name]:9.6g}{mark}\n")
    return int(any(value > limits[name] for name, value in figures.items()))


if __name__ == "__main__":
    sys.exit(main())
