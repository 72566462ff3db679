"""The kinds of pictures of a run, by name."""

from collections.abc import Callable

from blocksim.errors import InvalidInputError
from blocksim.scenario.spelling import nearest
from blocksim.view.final import draw_final
from blocksim.view.history import draw_history
from blocksim.view.strip import draw_strip

STRIP, FINAL, HISTORY = "strip", "final", "history"
# Each draws frames to a path, with title, measured table and support; a kind is one file and one line here.
KINDS: dict[str, Callable[..., None]] = {
    STRIP: draw_strip,
    FINAL: draw_final,
    HISTORY: draw_history,
}
MOST_SLIPS = 2


def kind_named(name: str) -> Callable[..., None]:
    """Return what draws pictures of a kind. Raises InvalidInputError for an unknown one."""
    if name not in KINDS:
        meant = nearest(name, KINDS, MOST_SLIPS)
        hint = f"did you mean '{meant}'?" if meant else f"choose {', '.join(KINDS)}"
        message = f"--kind {name}: unknown kind for a run, {hint}"
        raise InvalidInputError(message)
    return KINDS[name]
