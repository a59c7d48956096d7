"""The runner whose attempts compute somewhere in a Ray cluster, whose nodes need no folder in common.

What an attempt reads travels with it, and what it leaves beside its result travels back. Ray itself retries nothing and
remembers nothing that matters: the store decides whether there is another attempt, so Ray's head may die.
"""

import logging
import os
import queue
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from brdfcore.errors import InvalidValueError

from ..schemas import JobKind
from . import work
from .records import Attempt
from .runner import Event

_CALLS = 50  # attempts of one process
_LOOK = 0.02  # shortest wait for a word [s]
_log = logging.getLogger("service.jobs")

Item = tuple[str, ...] | dict[str, bytes]


@dataclass
class _Running:
    """An attempt in the cluster: the stream of its words, and what it has said last."""

    stream: Any
    word: Any = None  # the reference of the next one


class RayRunner:
    """One task an attempt, with so many CPUs and GPUs of the cluster at the address."""

    def __init__(self, address: str, data: Path, memory: int, *, cpus: float = 1.0, gpus: float = 0.0) -> None:
        os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
        try:
            import ray
        except ImportError:
            raise InvalidValueError(
                f"Expected the package ray to be installed, since ray_address is {address!r}. Install it with: "
                "pip install 'brdfcore[ray]'; or leave BRDF_RAY_ADDRESS empty to compute on this machine.",
                field="ray_address",
            ) from None
        self._ray, self._data, self._memory = ray, data, memory
        try:
            ray.init(address=address, namespace="brdfcore", log_to_driver=False, ignore_reinit_error=True)
        except (ConnectionError, RuntimeError, ValueError) as error:
            raise InvalidValueError(
                f"Expected a Ray cluster at {address!r}, got {type(error).__name__}. Start it, or correct "
                "BRDF_RAY_ADDRESS.",
                field="ray_address",
            ) from error
        # a process serves several attempts, one at a time: importing torch takes longer than most fits
        self._task = ray.remote(num_cpus=cpus, num_gpus=gpus, max_retries=0, max_calls=_CALLS)(_attempt)
        self._running: dict[Attempt, _Running] = {}

    def ready(self) -> bool:
        """Whether an attempt would begin at once; what has to wait for the cluster waits there."""
        return bool(self._ray.is_initialized())

    def start(self, attempt: Attempt) -> None:
        """Begin the attempt."""
        files = work.needed(self._data, attempt.kind, attempt.body)
        self._running[attempt] = _Running(
            self._task.options(num_returns="streaming").remote(files, attempt.kind, attempt.body, self._memory)
        )

    def poll(self, seconds: float) -> list[Event]:
        """What the attempts have said, after waiting at most so long for one of them to speak."""
        waiting = {running.stream: attempt for attempt, running in self._running.items()}
        if not waiting:
            return []
        ready, _ = self._ray.wait(list(waiting), num_returns=1, timeout=max(seconds, _LOOK), fetch_local=True)
        more, _ = self._ray.wait(list(waiting), num_returns=len(waiting), timeout=0, fetch_local=True)
        events = [event for stream in {*ready, *more} for event in self._heard(waiting[stream])]
        for event in events:
            if event.kind != "progress":
                self._running.pop(event.attempt, None)
        return events

    def kill(self, attempt: Attempt) -> None:
        """End the attempt, if it runs; no further event names it."""
        running = self._running.pop(attempt, None)
        if running is not None:
            self._ray.cancel(running.stream, force=True)

    def _heard(self, attempt: Attempt) -> list[Event]:
        """The next word of an attempt that has spoken; files come before the word that ends it."""
        running = self._running[attempt]
        try:
            item: Item = self._ray.get(next(running.stream))
        except StopIteration:
            return [Event(attempt, "crashed", "ended without a result")]
        except self._ray.exceptions.RayTaskError as error:
            return [Event(attempt, "crashed", f"raised {type(error.cause).__name__}")]
        except self._ray.exceptions.RayError as error:
            # a process that was killed and one that crashed look the same from here
            return [Event(attempt, "interrupted", f"lost its process in the cluster ({type(error).__name__})")]
        if isinstance(item, dict):
            _written(self._data, item)
            return []
        kind, text, *reason = item
        return [Event(attempt, kind, text, *reason)]  # type: ignore[arg-type]


def _attempt(files: dict[str, bytes], kind: JobKind, body: bytes, memory: int) -> Iterator[Item]:
    """The words of an attempt, in a process of the cluster; files that it has made come before its last word."""
    work.limit(memory)
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder)
        _written(data, files)
        words: queue.Queue[tuple[str, ...]] = queue.Queue()
        threading.Thread(target=work.answer, args=(words.put, data, kind, body, memory), daemon=True).start()
        word: tuple[str, ...] = ("progress", "")
        while word[0] == "progress":
            word = words.get()
            if word[0] == "succeeded":
                known = {path.relative_to(data).as_posix(): path for path in data.rglob("*") if path.is_file()}
                yield {name: path.read_bytes() for name, path in known.items() if name not in files}
            yield word


def _written(data: Path, files: dict[str, bytes]) -> None:
    """Write files under a folder, each whole or not at all."""
    for name, content in files.items():
        path = data / name
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.name}.{time.monotonic_ns()}")
        partial.write_bytes(content)
        partial.replace(path)
