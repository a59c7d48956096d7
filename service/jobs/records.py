"""The tables of the job store, what their rows are, and a connection to them."""

import sqlite3
from dataclasses import dataclass
from pathlib import Path

from brdfcore.errors import InvalidValueError

from ..schemas import JobKind, JobStatus

_TABLE = """
CREATE TABLE jobs (
    number    INTEGER PRIMARY KEY AUTOINCREMENT,
    id        TEXT NOT NULL UNIQUE,
    kind      TEXT NOT NULL,
    status    TEXT NOT NULL DEFAULT 'queued'
              CHECK (status IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    request   TEXT NOT NULL,
    progress  TEXT,
    result    TEXT,
    error     TEXT,
    attempts  INTEGER NOT NULL DEFAULT 0,
    interrupted INTEGER NOT NULL DEFAULT 0,  -- of the attempts, those that ended from outside
    held_until  REAL NOT NULL DEFAULT 0,     -- the end of the lease, or of the pause before the next attempt
    created   REAL NOT NULL,
    started   REAL,
    finished  REAL,
    owner     TEXT NOT NULL DEFAULT '',
    work      TEXT,
    reused    TEXT,
    promise   TEXT UNIQUE,
    promised  TEXT,
    batch     TEXT,
    body      BLOB NOT NULL  -- the last, because SQLite walks through what stands before the column that it looks for
) STRICT;
CREATE TABLE batches (
    number    INTEGER PRIMARY KEY AUTOINCREMENT,
    id        TEXT NOT NULL UNIQUE,
    request   TEXT NOT NULL,
    created   REAL NOT NULL,
    promise   TEXT UNIQUE,
    promised  TEXT
) STRICT;
CREATE INDEX jobs_by_batch ON jobs (batch, number) WHERE batch IS NOT NULL;
CREATE INDEX jobs_by_status ON jobs (status, number);
CREATE INDEX jobs_by_work ON jobs (work) WHERE work IS NOT NULL;
"""
BATCH = "number, id, request, created"
_VERSION = 3  # of the table
COLUMNS = "number, id, kind, status, request, progress, result, error, attempts, created, started, finished, reused"


@dataclass(frozen=True)
class Job:
    """A job as it stands; request, progress and result are JSON text, times are seconds since 1970."""

    number: int
    id: str
    kind: JobKind
    status: JobStatus
    request: str
    progress: str | None
    result: str | None
    error: str | None
    attempts: int
    created: float
    started: float | None
    finished: float | None
    reused: str | None = None  # the earlier job whose result this is


@dataclass(frozen=True)
class Promise:
    """A client's word that a submission under this key is the same one, sent again."""

    key: str
    content: str  # hash of the body that came with it


@dataclass(frozen=True)
class Asked:
    """What to submit; the fields are those of `JobStore.submit`."""

    request: str
    body: bytes
    kind: JobKind = "fit"
    work: str | None = None


@dataclass(frozen=True)
class Batch:
    """Jobs that were submitted together; `request` is JSON text."""

    number: int
    id: str
    request: str
    created: float


class BrokenPromiseError(Exception):
    """The key came before, with another body."""


class QueueFullError(Exception):
    """The owner has as many unfinished jobs as are allowed."""


@dataclass(frozen=True)
class Attempt:
    """A claimed job: its body, and the fencing number that every later word about it must carry."""

    id: str
    fence: int
    body: bytes
    kind: JobKind = "fit"


def connect(path: Path) -> sqlite3.Connection:
    """A connection for any thread, whose commits are on disk; InvalidValueError where that file cannot be one."""
    try:
        db = sqlite3.connect(path, timeout=5.0, isolation_level=None, check_same_thread=False)
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("PRAGMA synchronous = FULL")  # what was accepted survives a power cut
    except sqlite3.DatabaseError as error:
        if error.sqlite_errorcode not in (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY):
            raise
        raise InvalidValueError(
            f"Expected {path} to be a job store that can be written, got: {error}. Choose another data folder.",
            field="data",
        ) from error
    return db


def prepare(db: sqlite3.Connection) -> None:
    """Make the table; refuse one that another version has made."""
    db.execute("BEGIN IMMEDIATE")
    try:
        version = db.execute("PRAGMA user_version").fetchone()[0]
        made = bool(db.execute("SELECT 1 FROM sqlite_master").fetchall())
        if made and version != _VERSION:
            raise InvalidValueError(
                f"Expected jobs.sqlite3 to be of this version of the service ({_VERSION}), got version {version}. "
                "Choose another data folder, or the version that made it.",
                field="data",
            )
        for statement in _TABLE.split(";") if not made else ():
            db.execute(statement)
        db.execute(f"PRAGMA user_version = {_VERSION}")
        db.execute("COMMIT")
    finally:
        if db.in_transaction:  # half a table would be of no version
            db.execute("ROLLBACK")
