"""The thread that brings the store's jobs to the runner and the runner's words to the store.

One process a data folder has it at work: the one that holds the lock file. Others stand by and take over when the
lock is free. Whoever takes the lock knows that every earlier attempt is void, because attempts end with their server.
"""

import fcntl
import logging
import math
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

from .records import Attempt
from .retries import ASK_FOR_LESS
from .runner import Event, Runner
from .store import JobStore

_BUSY = 0.05  # how soon a cancelled attempt is noticed [s]
_SWEEP = 600.0  # how often what is old is looked for [s]
_IDLE = 0.5  # how soon a job is noticed that another process has submitted [s]

_log = logging.getLogger("service.jobs")


class Dispatcher:
    """Claims, renews, collects and retries while it runs; `stop` puts unfinished jobs back into the queue."""

    def __init__(
        self,
        store: JobStore,
        runner: Runner,
        lock: Path,
        *,
        workers: int,
        fit_seconds: float,
        sweep: Callable[[], None] = lambda: None,
        ended: Callable[[str, str], None] = lambda job_id, reason: None,
    ) -> None:
        """`sweep` is called now and then; `ended` for a job that has succeeded, with the reason "", or failed."""
        self._store, self._runner, self._lock = store, runner, lock
        self._workers, self._fit_seconds = workers, fit_seconds
        self._sweep, self._ended = sweep, ended
        self._swept = -math.inf
        self._ends: dict[Attempt, float] = {}  # when the time of each running attempt is up
        self._renewed = 0.0
        self._unsaved: list[Event] = []  # heard, but not yet in the store: it may be out of disk for a while
        self._wake, self._stopping = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def wake(self) -> None:
        """Look at the store now."""
        self._wake.set()

    def stop(self) -> None:
        """End every attempt, return the jobs to the queue and end the thread."""
        self._stopping.set()
        self._wake.set()
        self._thread.join()

    @property
    def alive(self) -> bool:
        """Whether the thread runs."""
        return self._thread.is_alive()

    def _run(self) -> None:
        with self._lock.open("w") as lock:
            while not _locked(lock):
                if self._stopping.wait(_IDLE):
                    return
            self._guarded(self._store.reclaim)
            while not self._stopping.is_set():
                if not self._guarded(self._step):
                    self._stopping.wait(1.0)  # a full disk or a store locked for long: nothing is lost, try again
            for attempt in self._ends:
                self._runner.kill(attempt)
            self._guarded(self._store.reclaim)

    def _step(self) -> None:
        while self._unsaved:
            self._save(self._unsaved[0])
            del self._unsaved[0]
        self._supervise()
        if time.monotonic() - self._swept > _SWEEP:
            self._swept = time.monotonic()
            self._sweep()
        ready = self._runner.ready()
        while ready and len(self._ends) < self._workers and (attempt := self._store.claim()):
            self._start(attempt)
        if self._ends:
            self._unsaved += self._runner.poll(_BUSY)
        elif not ready:
            self._stopping.wait(_BUSY)
        else:
            self._wake.wait(_IDLE)
            self._wake.clear()

    def _start(self, attempt: Attempt) -> None:
        try:
            self._runner.start(attempt)
        except Exception:
            _log.exception("the attempt %d at job %s did not start", attempt.fence, attempt.id)
            self._store.interrupt(attempt, "could not be started")
        else:
            self._ends[attempt] = time.monotonic() + self._fit_seconds

    def _supervise(self) -> None:
        now = time.monotonic()
        if self._ends and now - self._renewed > self._store.lease / 3:
            self._store.renew(self._ends)
            self._renewed = now
        held = self._store.running()
        for attempt, end in list(self._ends.items()):
            cancelled = held.get(attempt.id) != attempt.fence
            if cancelled or now > end:
                self._runner.kill(attempt)
                if not cancelled and self._store.fail(attempt, _overdue(self._fit_seconds)):
                    self._ended(attempt.id, "time")
                del self._ends[attempt]

    def _save(self, event: Event) -> None:
        if event.kind == "progress":
            self._store.progress(event.attempt, event.text)
            return
        job_id = event.attempt.id
        if event.kind == "succeeded":
            if self._store.succeed(event.attempt, event.text):
                self._ended(job_id, "")
        elif event.kind == "failed":
            if self._store.fail(event.attempt, event.text):
                self._ended(job_id, event.reason)
        else:
            _log.warning("the attempt %d at job %s %s", event.attempt.fence, job_id, event.text)
            again = self._store.retry if event.kind == "crashed" else self._store.interrupt
            if again(event.attempt, event.text) == "failed":
                self._ended(job_id, event.kind)
        self._ends.pop(event.attempt, None)

    def _guarded(self, action: Callable[[], None]) -> bool:
        """Whether the action went through; what it raised is in the log."""
        try:
            action()
        except Exception:
            _log.exception("the dispatcher could not work on its jobs and will try again")
            return False
        return True


def _locked(lock: TextIO) -> bool:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _overdue(seconds: float) -> str:
    return f"Expected the job to end within {seconds:g} s, but it did not. {ASK_FOR_LESS}"
