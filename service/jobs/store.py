# ruff: noqa: S608 - what is put into a query's text here are constants of this file; values go as parameters
"""The durable job store: one SQLite table, changed only by single conditional UPDATEs.

A job is a fit or a table of albedos. It is queued, then running under a lease, then succeeded, failed or cancelled.
Each claim adds 1 to `attempts`, which is also the fencing number: whoever holds an older number, or a job that is no
longer running, is refused.

An attempt that ends without an answer is followed by another, as retries.py says.
Work that has succeeded before, told by the hash of what determines its result, succeeds at once with that result.

Every write is BEGIN IMMEDIATE: a deferred transaction that writes after a read fails at once when another has
written in between, whatever the timeout.
"""

import contextlib
import math
import sqlite3
import threading
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..schemas import JobKind, JobStatus
from .records import (
    BATCH,
    COLUMNS,
    Asked,
    Attempt,
    Batch,
    BrokenPromiseError,
    Job,
    Promise,
    QueueFullError,
    connect,
    prepare,
)
from .retries import COUNTED, CRASHED_OUT, INTERRUPTED_OUT, PAUSE, crashed_out, ended, interrupted_out


class JobStore:
    """The jobs of one data folder; usable from every thread and from several processes at once."""

    def __init__(self, path: Path, *, lease: float = 30.0, clock: Callable[[], float] = time.time) -> None:
        self.lease = lease
        self._clock = clock
        self._writing, self._reading = threading.Lock(), threading.Lock()
        self._writer = connect(path)
        prepare(self._writer)
        self._reader = connect(path)  # reads never wait for a write to reach the disk
        self._reader.execute("PRAGMA query_only = ON")

    def close(self) -> None:
        """Let go of the files."""
        self._reader.close()
        self._writer.close()

    def submit(
        self,
        request: str,
        body: bytes,
        kind: JobKind = "fit",
        *,
        work: str | None = None,
        owner: str = "",
        most: int | None = None,
        promise: Promise | None = None,
    ) -> Job:
        """A new queued job; `request` is what to show of it, `body` what to work on.

        work      hash of all that determines the result: where a job of the same has succeeded, so has this one
        most      unfinished jobs that the owner may have; QueueFullError beyond
        promise   where it was kept before, the job of that time; BrokenPromiseError where its content differs
        """
        with self._write() as db:
            if promise is not None:
                known = db.execute(f"SELECT promised, {COLUMNS} FROM jobs WHERE promise = ?", (promise.key,)).fetchall()
                if known and known[0][0] != promise.content:
                    raise BrokenPromiseError
                if known:
                    return _job(known[0][1:])
            (job,) = self._added(db, [Asked(request, body, kind, work)], owner, most)
            if promise is not None:
                db.execute(
                    "UPDATE jobs SET promise = ?, promised = ? WHERE id = ?", (promise.key, promise.content, job.id)
                )
        return job

    def submit_batch(
        self, request: str, asked: Sequence[Asked], *, owner: str = "", most: int | None = None, promise: Promise | None
    ) -> Batch:
        """New queued jobs that belong together, all or none of them; `most` and `promise` are as in `submit`."""
        batch_id = uuid.uuid4().hex
        with self._write() as db:
            if promise is not None:
                known = db.execute(
                    f"SELECT promised, {BATCH} FROM batches WHERE promise = ?", (promise.key,)
                ).fetchall()
                if known and known[0][0] != promise.content:
                    raise BrokenPromiseError
                if known:
                    return Batch(*known[0][1:])
            self._added(db, asked, owner, most, batch_id)
            kept = (None, None) if promise is None else (promise.key, promise.content)
            rows = db.execute(
                "INSERT INTO batches (id, request, created, promise, promised) VALUES (?, ?, ?, ?, ?) "
                f"RETURNING {BATCH}",
                (batch_id, request, self._clock(), *kept),
            ).fetchall()
        return Batch(*rows[0])

    def _added(
        self, db: sqlite3.Connection, asked: Sequence[Asked], owner: str, most: int | None, batch: str | None = None
    ) -> list[Job]:
        """New jobs; those whose work has succeeded before have, too."""
        unfinished = "SELECT count(*) FROM jobs WHERE owner = ? AND status IN ('queued', 'running')"
        room = math.inf if most is None else most - db.execute(unfinished, (owner,)).fetchone()[0]
        now, made = self._clock(), []
        for one in asked:
            given: dict[str, object] = {"id": uuid.uuid4().hex, "kind": one.kind, "body": one.body, "created": now}
            given |= {"request": one.request, "owner": owner, "work": one.work, "batch": batch}
            earlier = db.execute(
                "SELECT id, result FROM jobs WHERE work = ? AND kind = ? AND status = 'succeeded' LIMIT 1",
                (one.work, one.kind),
            ).fetchall()
            if earlier:
                given |= {"status": "succeeded", "reused": earlier[0][0], "result": earlier[0][1]}
                given |= {"started": now, "finished": now}
            else:
                room -= 1
            if room < 0:
                raise QueueFullError
            places = ", ".join("?" * len(given))
            rows = db.execute(
                f"INSERT INTO jobs ({', '.join(given)}) VALUES ({places}) RETURNING {COLUMNS}", (*given.values(),)
            ).fetchall()
            made.append(_job(rows[0]))
        return made

    def batch(self, batch_id: str) -> Batch | None:
        """The batch of that id."""
        rows = self._read(f"SELECT {BATCH} FROM batches WHERE id = ?", batch_id)
        return Batch(*rows[0]) if rows else None

    def batches(self, limit: int, before: int | None = None) -> list[Batch]:
        """Up to `limit` batches with numbers below `before`, newest first."""
        number = 2**63 - 1 if before is None else before
        rows = self._read(f"SELECT {BATCH} FROM batches WHERE number < ? ORDER BY number DESC LIMIT ?", number, limit)
        return [Batch(*row) for row in rows]

    def of_batch(self, batch_id: str) -> list[Job]:
        """The jobs of a batch, in the order of its request; those that were removed since are missing."""
        return [
            _job(row) for row in self._read(f"SELECT {COLUMNS} FROM jobs WHERE batch = ? ORDER BY number", batch_id)
        ]

    def standing(self, batch_id: str) -> list[tuple[JobStatus, str | None]]:
        """Status and progress of each job of a batch."""
        return self._read("SELECT status, progress FROM jobs WHERE batch = ?", batch_id)

    def cancel_batch(self, batch_id: str) -> None:
        """Cancel what of the batch is queued or running."""
        with self._write() as db:
            db.execute(
                "UPDATE jobs SET status = 'cancelled', finished = ? "
                "WHERE batch = ? AND status IN ('queued', 'running')",
                (self._clock(), batch_id),
            )

    def delete_batch(self, batch_id: str) -> bool:
        """Whether there was such a batch; now there is none, and none of its jobs."""
        with self._write() as db:
            db.execute("DELETE FROM jobs WHERE batch = ?", (batch_id,))
            return db.execute("DELETE FROM batches WHERE id = ?", (batch_id,)).rowcount == 1

    def get(self, job_id: str) -> Job | None:
        """The job of that id."""
        rows = self._read(f"SELECT {COLUMNS} FROM jobs WHERE id = ?", job_id)
        return _job(rows[0]) if rows else None

    def newest(
        self, limit: int, before: int | None = None, kind: JobKind = "fit", status: JobStatus | None = None
    ) -> list[Job]:
        """Up to `limit` jobs of a kind, and of a status, with numbers below `before`, newest first; without results."""
        rows = self._read(
            f"SELECT {COLUMNS.replace('result', 'NULL')} FROM jobs "
            "WHERE number < ? AND kind = ? AND status = coalesce(?, status) ORDER BY number DESC LIMIT ?",
            2**63 - 1 if before is None else before,
            kind,
            status,
            limit,
        )
        return [_job(row) for row in rows]

    def counts(self) -> list[tuple[str, str, int]]:
        """How many jobs there are of each kind and status."""
        return self._read("SELECT kind, status, count(*) FROM jobs GROUP BY kind, status")

    def forget(self, before: float) -> int:
        """How many jobs had ended before that time [s since 1970]; they are removed."""
        if not self._read("SELECT 1 FROM jobs WHERE finished < ? LIMIT 1", before):
            return 0
        with self._write() as db:
            count = db.execute("DELETE FROM jobs WHERE finished < ?", (before,)).rowcount
            db.execute(
                "DELETE FROM batches WHERE created < ? AND id NOT IN (SELECT batch FROM jobs WHERE batch > '')",
                (before,),
            )
            return count

    def body(self, job_id: str) -> bytes | None:
        """What the job works on, as it was submitted."""
        rows = self._read("SELECT body FROM jobs WHERE id = ?", job_id)
        return bytes(rows[0][0]) if rows else None

    def asks_for(self, dataset: str) -> bool:
        """Whether a job is of that dataset."""
        return bool(self._read("SELECT 1 FROM jobs WHERE instr(request, ?) LIMIT 1", dataset))

    def mentioned(self, kind: JobKind, text: str) -> bool:
        """Whether the result of a job of that kind mentions the text."""
        return bool(self._read("SELECT 1 FROM jobs WHERE kind = ? AND instr(result, ?) LIMIT 1", kind, text))

    def claim(self) -> Attempt | None:
        """The oldest job that is queued and need not pause, or whose lease has run out; it runs under a new lease."""
        now = self._clock()
        due = "status IN ('queued', 'running') AND held_until < ?"
        if not self._read(f"SELECT 1 FROM jobs WHERE {due} LIMIT 1", now):
            return None  # an idle dispatcher takes no write lock
        with self._write() as db:
            db.execute(
                "UPDATE jobs SET status = 'failed', error = ?, finished = ? "
                f"WHERE status = 'running' AND held_until < ? AND {INTERRUPTED_OUT}",
                (interrupted_out("was abandoned by its worker"), now, now),
            )
            rows = db.execute(
                "UPDATE jobs SET status = 'running', attempts = attempts + 1, held_until = ?, progress = NULL, "
                "started = coalesce(started, ?), interrupted = interrupted + (status = 'running') "
                f"WHERE number = (SELECT number FROM jobs WHERE {due} ORDER BY number LIMIT 1) "
                "RETURNING id, attempts, body, kind",
                (now + self.lease, now, now),
            ).fetchall()
        return Attempt(*rows[0]) if rows else None

    def running(self) -> dict[str, int]:
        """The fencing number of each running job, by id."""
        return dict(self._read("SELECT id, attempts FROM jobs WHERE status = 'running'"))

    def renew(self, attempts: Iterable[Attempt]) -> None:
        """Extend the leases of those attempts that still hold theirs."""
        end = self._clock() + self.lease
        with self._write() as db:
            db.executemany(
                "UPDATE jobs SET held_until = ? WHERE id = ? AND attempts = ? AND status = 'running'",
                [(end, attempt.id, attempt.fence) for attempt in attempts],
            )

    def progress(self, attempt: Attempt, progress: str) -> bool:
        """Whether the attempt still holds its job; if so, its progress is on record."""
        return self._held("progress = ?", attempt, progress)

    def succeed(self, attempt: Attempt, result: str) -> bool:
        """Whether the attempt still held its job; if so, it has succeeded with this result."""
        return self._held("status = 'succeeded', result = ?, finished = ?", attempt, result, self._clock())

    def fail(self, attempt: Attempt, error: str) -> bool:
        """Whether the attempt still held its job; if so, it has failed for this reason."""
        return self._held("status = 'failed', error = ?, finished = ?", attempt, error, self._clock())

    def retry(self, attempt: Attempt, what: str) -> JobStatus | None:
        """What became of a job that crashed: queued again or failed; None if the attempt had lost it."""
        return self._again(attempt, CRASHED_OUT, crashed_out(what), "held_until = 0")

    def interrupt(self, attempt: Attempt, what: str) -> JobStatus | None:
        """What became of a job that was ended from outside: queued again or failed; None if the attempt had lost it."""
        change = f"{COUNTED}, held_until = ? + {PAUSE}"
        return self._again(attempt, INTERRUPTED_OUT, interrupted_out(what), change, self._clock())

    def _again(self, attempt: Attempt, over: str, error: str, change: str, *values: object) -> JobStatus | None:
        held = self._held(f"{change}, {ended(over)}", attempt, *values, error, self._clock())
        job = self.get(attempt.id) if held else None
        return job.status if job else None

    def reclaim(self) -> None:
        """Queue every running job again: for the one process that knows that nobody works on any of them."""
        with self._write() as db:
            db.execute(
                f"UPDATE jobs SET held_until = 0, {COUNTED}, {ended(INTERRUPTED_OUT)} WHERE status = 'running'",
                (interrupted_out("ended with its server"), self._clock()),
            )

    def cancel(self, job_id: str) -> Job | None:
        """The job, cancelled if it was queued or running, else as it stands."""
        with self._write() as db:
            db.execute(
                "UPDATE jobs SET status = 'cancelled', finished = ? WHERE id = ? AND status IN ('queued', 'running')",
                (self._clock(), job_id),
            )
        return self.get(job_id)

    def delete(self, job_id: str) -> Job | None:
        """The job as it was; now there is none."""
        with self._write() as db:
            rows = db.execute(f"DELETE FROM jobs WHERE id = ? RETURNING {COLUMNS}", (job_id,)).fetchall()
        return _job(rows[0]) if rows else None

    def _held(self, change: str, attempt: Attempt, *values: object) -> bool:
        with self._write() as db:
            changed = db.execute(
                f"UPDATE jobs SET {change} WHERE id = ? AND attempts = ? AND status = 'running'",
                (*values, attempt.id, attempt.fence),
            )
            return changed.rowcount == 1

    @contextlib.contextmanager
    def _write(self) -> Iterator[sqlite3.Connection]:
        with self._writing:
            self._writer.execute("BEGIN IMMEDIATE")
            try:
                yield self._writer
                self._writer.execute("COMMIT")
            except BaseException:
                if self._writer.in_transaction:  # a full disk rolls back by itself
                    self._writer.execute("ROLLBACK")
                raise

    def _read(self, query: str, *values: object) -> list[Any]:
        with self._reading:
            return self._reader.execute(query, values).fetchall()


def _job(row: Any) -> Job:
    return Job(*row)  # the table is STRICT, and COLUMNS names the fields in order
