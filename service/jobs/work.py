"""What runs in the process of one attempt: read what was asked, compute, send progress and then the result.

The fork server imports this module once, torch included (warm.py), and each attempt is a fork of it.
"""

import json
import logging
import math
import os
import resource
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path

import torch

from brdfcore.errors import BrdfError
from brdfcore.fitting import Progress, fit
from brdfcore.fitting.comparison import compare

from .. import disk, log, renders, tables
from ..datasets import Datasets
from ..schemas import AlbedoRequest, FitRequest, JobKind, RenderRequest
from .retries import ASK_FOR_LESS

_PROGRESS_EVERY = 0.1  # [s]; each word of progress becomes a write to the disk

Say = Callable[[tuple[str, ...]], object]  # hears a word

_log = logging.getLogger("service.jobs")


def run(out: Connection, data: str, kind: JobKind, body: bytes, memory: int) -> None:
    """Send the words of an attempt, as `answer` gives them, from a process of its own."""
    _settle(memory)
    answer(out.send, Path(data), kind, body, memory)


def answer(say: Say, data: Path, kind: JobKind, body: bytes, memory: int) -> None:
    """Say ("progress", JSON) any number of times, then one of the others.

    ("succeeded", JSON), ("failed", sentence, reason), or ("interrupted", what happened) by what is not the job's doing.
    """
    try:
        say(("succeeded", _WORK[kind](say, data, body)))
    except BrdfError as error:
        say(("failed", str(error), "data"))
    except Exception as error:
        if disk.full(error):
            say(("interrupted", "found the disk full"))
            return
        if isinstance(error, MemoryError) or "allocate memory" in str(error):  # torch raises RuntimeError for it
            sentence = f"Expected the job to need less than {memory} bytes, but it asked for more. {ASK_FOR_LESS}"
            reason = "memory"
        else:
            _log.exception("a job raised")
            reason = "internal"
            sentence = (
                f"The job stopped with an internal error, {type(error).__name__}. The server's log has the details."
            )
        say(("failed", sentence, reason))


def needed(data: Path, kind: JobKind, body: bytes) -> dict[str, bytes]:
    """The files that an attempt reads, by their paths under the data folder."""
    if kind != "fit":
        return {}
    name = FitRequest.model_validate_json(body).dataset
    return {} if name is None else Datasets(data).files(name)


def _fitted(say: Say, data: Path, body: bytes) -> str:
    request = FitRequest.model_validate_json(body)
    samples = Datasets(data).samples(request)
    last = -math.inf

    def report(progress: Progress) -> None:
        nonlocal last
        if time.monotonic() - last < _PROGRESS_EVERY and progress.fraction < 1:
            return
        last = time.monotonic()
        loss = progress.loss if math.isfinite(progress.loss) else None
        say(("progress", json.dumps({"stage": progress.stage, "fraction": progress.fraction, "loss": loss})))

    arguments = {**request.arguments(), "progress": report}
    if request.models is None:
        result = fit(samples, request.asked, **arguments).to_dict()
    else:
        compared = compare(samples, request.models, **arguments)
        result = {**compared.best.to_dict(), "comparison": compared.to_dict()}
    return json.dumps(result, allow_nan=False)


def _tabulated(say: Say, data: Path, body: bytes) -> str:
    """Facts about the table, which itself is in the folder of tables under its hash."""
    made = tables.made(AlbedoRequest.model_validate_json(body), data, _shares(say, "table"))
    return json.dumps(made, allow_nan=False)


def _rendered(say: Say, data: Path, body: bytes) -> str:
    """Facts about the image, which itself is in the folder of images under its hash."""
    made = renders.made(RenderRequest.model_validate_json(body), data, _shares(say, "render"))
    return json.dumps(made, allow_nan=False)


def _shares(say: Say, stage: str) -> Callable[[float], None]:
    """What hears which share of the work is done, and says so now and then."""
    last = -math.inf

    def report(fraction: float) -> None:
        nonlocal last
        if time.monotonic() - last >= _PROGRESS_EVERY or fraction >= 1:
            last = time.monotonic()
            say(("progress", json.dumps({"stage": stage, "fraction": fraction, "loss": None})))

    return report


_WORK: dict[JobKind, Callable[[Say, Path, bytes], str]] = {
    "fit": _fitted,
    "albedo_table": _tabulated,
    "render": _rendered,
}


def _settle(memory: int) -> None:
    """Make this process a quiet, bounded one that does not outlive the server."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole terminal; the server decides what follows
    os.nice(10)
    log.begin("warning")
    limit(memory)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def limit(memory: int) -> None:
    """Bound what this process may allocate [bytes]."""
    # not RLIMIT_AS: torch maps more addresses than any sensible bound
    _, most = resource.getrlimit(resource.RLIMIT_DATA)  # what the system sets already, nobody may raise
    bound = memory if most == resource.RLIM_INFINITY else min(memory, most)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, most))
    torch.set_num_threads(1)


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
