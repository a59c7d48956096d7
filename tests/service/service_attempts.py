"""What attempts do in the tests of the runner: each function stands in for service.jobs.work.run."""

import logging
import os
import pathlib
import signal
import time
from multiprocessing.connection import Connection

import torch

from service.jobs import work


def answers(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    out.send(("progress", '{"stage": "fit", "fraction": 0.5, "loss": null}'))
    out.send(("succeeded", body.decode().upper()))


def refuses(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    out.send(("failed", "Expected something else."))


def faults(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def killed_three_times(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    with (pathlib.Path(data) / "kills").open("a+") as marks:
        marks.write("x")
        if marks.tell() < 4:
            marks.flush()
            os.kill(os.getpid(), signal.SIGKILL)
    out.send(("succeeded", "{}"))


def dies_once(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    mark = pathlib.Path(data) / "died"
    if not mark.exists():
        mark.touch()
        os._exit(7)
    out.send(("succeeded", "{}"))


def hangs(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    (pathlib.Path(data) / "pid").write_text(str(os.getpid()))
    time.sleep(600)


def asks_for_too_much(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    work.fit = lambda *arguments, **keywords: torch.ones(2**31, dtype=torch.float64)  # 16 GiB
    work.run(out, data, "fit", body, memory)


def trips(out: Connection, data: str, kind: str, body: bytes, memory: int) -> None:
    logging.getLogger("service.jobs").addHandler(logging.FileHandler(pathlib.Path(data) / "log"))
    work.fit = lambda *arguments, **keywords: [][0]
    work.run(out, data, "fit", body, memory)
