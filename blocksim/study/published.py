"""Tables of published or measured limits, drawn beside those that a search found."""

from pathlib import Path

from blocksim.errors import Problem
from blocksim.scenario.csv_table import raise_problems, read_table
from blocksim.view.limit_curve import Series

OVER, LIMIT, SERIES = "over", "limit", "series"


def read_published(path: Path, over_unit: str, unit: str) -> tuple[Series, ...]:
    """Return the series of a table in the order of their first rows: value of the other key, limit, and name.

    Its columns are `over`, `limit` and `series`, the first two with the units of the search in brackets where there
    are any: `limit [m]`. Raises InputMissingError, and InvalidInputError with the place of every mistake.
    """
    over, limit = _head(OVER, over_unit), _head(LIMIT, unit)
    table = read_table(path, (over, limit, SERIES))
    problems = list(table.problems)
    found: dict[str, list[tuple[float, float]]] = {}
    for row in table.rows:
        place: list[float] = []
        for cell in (row[over], row[limit]):
            try:
                place.append(cell.number())
            except ValueError as error:
                problems.append(cell.problem(str(error)))
        if len(place) == 2:
            found.setdefault(row[SERIES].text, []).append((place[0], place[1]))
    if not problems and not found:
        problems.append(Problem(str(path), "the table has no rows"))
    if problems:
        raise_problems(problems)
    return tuple(Series(name, tuple(points)) for name, points in found.items())


def _head(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
