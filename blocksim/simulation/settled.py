"""What run.json says of a scene that was brought to rest before time zero, and the word for one that was not."""

from pydantic import BaseModel

NOT_AT_REST = "does not come to rest before time zero"


class Settled(BaseModel, frozen=True):
    """How a scene came to rest, or how far it got."""

    steps: int
    largest_displacement_mm: float
    displaced_block: str
    held: tuple[str, ...] = ()
    at_rest: bool = True  # False where it was released all the same (`start.release`)
