"""Making the folder that results are written to, or saying what is in the way."""

from pathlib import Path

from blocksim.errors import OutputExistsError


def make_folder(folder: Path) -> None:
    """Create a folder and those around it, where they are missing; links to folders are followed.

    Raises OutputExistsError where something that is no folder is in the way, or none can be created there.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"{folder}: cannot be created: {_what_is_in_the_way(folder) or error.strerror or error}"
        raise OutputExistsError(message) from error


def _what_is_in_the_way(folder: Path) -> str:
    """Return which part of a path is no folder and what it is instead, or nothing."""
    try:
        for place in (folder, *folder.parents):
            if place.is_symlink() and not place.exists():
                return f"{place} is a link that leads nowhere"
            if place.exists() and not place.is_dir():
                return f"{place} is a file, not a folder"
    except OSError:  # a name that is too long, which the system tells of
        pass
    return ""
