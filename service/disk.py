"""The disk: whether an error says that it is full, and what is old on it and can go."""

import errno
import sqlite3
from collections.abc import Callable
from pathlib import Path


def full(error: BaseException) -> bool:
    """Whether there is no room on the disk, or none left of what this user may take."""
    if isinstance(error, sqlite3.OperationalError):
        return error.sqlite_errorcode == sqlite3.SQLITE_FULL
    return isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT)


def forget(folder: Path, before: float, mentioned: Callable[[str], bool]) -> int:
    """How many files older than that time [s since 1970] are removed: those whose hash, their stem, no job mentions."""
    old = [path for path in folder.glob("*.*") if path.stat().st_mtime < before]
    gone = [path for path in old if not mentioned(path.stem)]
    for path in gone:
        path.unlink(missing_ok=True)
    return len(gone)
