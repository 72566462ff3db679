"""The kinds of pictures of a sweep; by default the first that suits it is drawn."""

from blocksim.view.sweeps.found import FoundSweep
from blocksim.view.sweeps.histogram import HISTOGRAM
from blocksim.view.sweeps.kind import Kind
from blocksim.view.sweeps.lines import LINES
from blocksim.view.sweeps.map import MAP
from blocksim.view.sweeps.matrix import MATRIX

KINDS = {
    "lines": LINES,
    "map": MAP,
    "matrix": MATRIX,
    "histogram": HISTOGRAM,
}


def kind_for(sweep: FoundSweep) -> Kind:
    """Return the first kind that suits a sweep."""
    return next(kind for kind in KINDS.values() if not kind.refusal(sweep) and kind.suits(sweep))
