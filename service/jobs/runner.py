"""Where attempts compute: the interface, and the runner that gives each attempt a process of its own."""

import contextlib
import importlib.machinery
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Literal, Protocol

from ..schemas import JobKind
from . import work
from .records import Attempt

Work = Callable[[Connection, str, JobKind, bytes, int], None]
# exit codes that an attempt has no part in: killed, by hand or for want of memory; and the fork server's own end
_OUTSIDE = (-signal.SIGKILL, -signal.SIGTERM, -signal.SIGHUP, -signal.SIGINT, -signal.SIGQUIT, 255)


@dataclass(frozen=True)
class Event:
    """A word from an attempt: JSON of progress, JSON of the result, or a sentence; after "progress" it goes on.

    An attempt that ends without an answer has crashed by itself, or was interrupted from outside.
    """

    attempt: Attempt
    kind: Literal["progress", "succeeded", "failed", "crashed", "interrupted"]
    text: str
    reason: str = ""  # of a failure, in one word: data, memory or internal


class Runner(Protocol):
    """What computes attempts. It keeps no promise beyond one attempt: the store decides whether there is another."""

    def ready(self) -> bool:
        """Whether an attempt would begin at once."""

    def start(self, attempt: Attempt) -> None:
        """Begin the attempt."""

    def poll(self, seconds: float) -> list[Event]:
        """What the attempts have said, after waiting at most so long for one of them to speak."""

    def kill(self, attempt: Attempt) -> None:
        """End the attempt, if it runs; no further event names it."""


class LocalRunner:
    """One process an attempt, forked from a server that has imported torch, with one thread each."""

    def __init__(self, data: Path, memory: int, target: Work = work.run) -> None:
        self._data, self._memory, self._target = str(data), memory, target
        self._running: dict[Attempt, tuple[ForkServerProcess, Connection]] = {}
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(["service.jobs.warm"])
        # before torch is imported there; two processes with default threads take 4 times as long as with one each
        os.environ["OMP_NUM_THREADS"] = "1"
        self._ready = threading.Event()
        threading.Thread(target=self._warm_up, name="warm-up", daemon=True).start()

    def ready(self) -> bool:
        """Whether the fork server has imported torch, which takes some seconds once in a server's life."""
        return self._ready.is_set()

    def start(self, attempt: Attempt) -> None:
        """Begin the attempt."""
        here, there = self._context.Pipe(duplex=False)
        arguments = (there, self._data, attempt.kind, attempt.body, self._memory)
        process = self._context.Process(target=self._target, args=arguments, daemon=True)
        try:
            with _no_main():
                process.start()
        except BaseException:
            here.close()
            raise
        finally:
            there.close()
        self._running[attempt] = process, here

    def poll(self, seconds: float) -> list[Event]:
        """What the attempts have said, after waiting at most so long for one of them to speak."""
        ready = wait([pipe for _, pipe in self._running.values()], seconds)
        events = [self._heard(attempt) for attempt, (_, pipe) in self._running.items() if pipe in ready]
        for event in events:
            if event.kind != "progress":
                self.kill(event.attempt)
        return events

    def kill(self, attempt: Attempt) -> None:
        """End the attempt, if it runs; no further event names it."""
        if attempt in self._running:
            process, pipe = self._running.pop(attempt)
            process.kill()
            process.join()
            process.close()
            pipe.close()

    def _warm_up(self) -> None:
        try:
            process = self._context.Process(target=int, daemon=True)  # does nothing, but only when there is a server
            with _no_main():
                process.start()
            process.join()
        finally:  # if it failed, so will the attempts, and their jobs say so
            self._ready.set()

    def _heard(self, attempt: Attempt) -> Event:
        process, pipe = self._running[attempt]
        try:
            kind, text, *reason = pipe.recv()
        except (EOFError, OSError):  # the process is gone, perhaps in the middle of a word
            process.join(5.0)
            code = process.exitcode
            return Event(attempt, "interrupted" if code in _OUTSIDE else "crashed", f"ended with exit code {code}")
        return Event(attempt, kind, text, *reason)


_main_lock = threading.Lock()


@contextlib.contextmanager
def _no_main() -> Iterator[None]:
    """Processes started here do not run the main script again, which multiprocessing does for pickled classes of it.

    That script may be anything, and none of its classes is ever sent. Multiprocessing leaves a main module alone that
    is the __main__.py of a package, so for this moment it is one.
    """
    with _main_lock:
        main = sys.modules["__main__"]
        spec = main.__spec__
        main.__spec__ = importlib.machinery.ModuleSpec("service.__main__", None)
        try:
            yield
        finally:
            main.__spec__ = spec
