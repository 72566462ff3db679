"""Who may change what is kept on the disk: compiled kernels are executed, so only this user may have written them.

Systems without owners, such as Windows, keep a user's cache in a folder of that user; nothing is looked at there.
"""

import contextlib
import os
import stat
from pathlib import Path

HAS_OWNERS = hasattr(os, "getuid")
UNMAPPED = 65534  # owner of what lies outside a container, whoever that is there
"""What Linux tells as the owner of files whose owner has no number in a user namespace."""


def is_own(state: os.stat_result) -> bool:
    """Return True if a file or folder belongs to this user, and no other may write to it."""
    return not HAS_OWNERS or (state.st_uid == os.getuid() and not state.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def trouble_with(folder: Path) -> str:
    """Return why others could put something of theirs into a folder, or another one in its place; else nothing.

    A sticky folder on the way, as /tmp is, keeps others from renaming what is in it. Raises OSError.
    """
    if not HAS_OWNERS:
        return ""
    folder = folder.resolve()
    if not is_own(folder.stat()):
        return f"{folder}: other users may write there"
    for parent in folder.parents:
        state = parent.stat()
        if state.st_uid not in {os.getuid(), 0, UNMAPPED} or (
            _others_write(state) and not state.st_mode & stat.S_ISVTX
        ):
            return f"{folder}: other users may write to {parent}"
    return ""


def _others_write(state: os.stat_result) -> bool:
    if state.st_mode & stat.S_IWOTH:
        return True
    return bool(state.st_mode & stat.S_IWGRP) and not _is_group_of_one(state.st_gid)


def _is_group_of_one(number: int) -> bool:
    """Return True for the group that many systems give each user, with nobody else in it."""
    import grp  # noqa: PLC0415 - not there without owners
    import pwd  # noqa: PLC0415

    with contextlib.suppress(KeyError):
        user, group = pwd.getpwuid(os.getuid()), grp.getgrgid(number)
        return number == user.pw_gid != 0 and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
    return False
