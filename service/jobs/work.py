"""What runs in the process of one attempt: read the samples, fit, send progress and then the result.

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
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path

import torch

from brdfcore.errors import BrdfError
from brdfcore.fitting import Progress, fit

from ..datasets import Datasets
from ..schemas import FitRequest

_PROGRESS_EVERY = 0.1  # [s]; each word of progress becomes a write to the disk

_log = logging.getLogger("service.jobs")


def run(out: Connection, data: str, body: bytes, memory: int) -> None:
    """Send ("progress", JSON) any number of times, then ("succeeded", JSON) or ("failed", sentence)."""
    _settle(memory)
    try:
        out.send(("succeeded", _fitted(out, data, body)))
    except BrdfError as error:
        out.send(("failed", str(error)))
    except Exception as error:
        if isinstance(error, MemoryError) or "allocate memory" in str(error):  # torch raises RuntimeError for it
            sentence = f"Expected the fit to need less than {memory} bytes, but it asked for more. Use fewer samples."
        else:
            _log.exception("a fit raised")
            sentence = (
                f"The fit stopped with an internal error, {type(error).__name__}. The server's log has the details."
            )
        out.send(("failed", sentence))


def _fitted(out: Connection, data: str, body: bytes) -> str:
    request = FitRequest.model_validate_json(body)
    samples = Datasets(Path(data)).samples(request)
    last = -math.inf

    def report(progress: Progress) -> None:
        nonlocal last
        if time.monotonic() - last < _PROGRESS_EVERY and progress.fraction < 1:
            return
        last = time.monotonic()
        loss = progress.loss if math.isfinite(progress.loss) else None
        out.send(("progress", json.dumps({"stage": progress.stage, "fraction": progress.fraction, "loss": loss})))

    fitted = fit(
        samples,
        request.model,
        loss=request.loss,
        optimizer=request.optimizer,
        fixed=request.fixed,
        gray=tuple(request.gray),
        per_channel=tuple(request.per_channel),
        seed=request.seed,
        progress=report,
    )
    return json.dumps(fitted.to_dict(), allow_nan=False)


def _settle(memory: int) -> None:
    """Make this process a quiet, bounded one that does not outlive the server."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole terminal; the server decides what follows
    os.nice(10)
    torch.set_num_threads(1)
    # not RLIMIT_AS: torch maps more addresses than any sensible bound
    resource.setrlimit(resource.RLIMIT_DATA, (memory, resource.RLIM_INFINITY))
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
