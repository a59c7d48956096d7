"""Whether an error says that the disk is full."""

import errno
import sqlite3


def full(error: BaseException) -> bool:
    """Whether there is no room on the disk, or none left of what this user may take."""
    if isinstance(error, sqlite3.OperationalError):
        return error.sqlite_errorcode == sqlite3.SQLITE_FULL
    return isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT)
