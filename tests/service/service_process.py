"""A real server process of a data folder, and what lives in its session."""

import contextlib
import os
import pathlib
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

from service.client import Client, ClientError

SERVE = """
from service.app import server
from service.settings import Settings
server(Settings.from_environment()).run()
"""
# counts in the database how often each job has succeeded
COUNTING = """
CREATE TABLE commits (job TEXT NOT NULL);
CREATE TRIGGER committed AFTER UPDATE OF status ON jobs WHEN NEW.status = 'succeeded'
BEGIN INSERT INTO commits VALUES (NEW.id); END;
"""
SLOW = {"model": "lambert + kurt"}  # long enough for a kill to find it running


@contextlib.contextmanager
def server(data: pathlib.Path, workers: int = 1) -> Iterator[tuple[subprocess.Popen[bytes], Client]]:
    """A server of that data folder in a session of its own, and a client of it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    environment = os.environ | {"BRDF_DATA": str(data), "BRDF_PORT": str(port), "BRDF_WORKERS": str(workers)}
    with (data.parent / "server.log").open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, "-c", SERVE], env=environment, start_new_session=True, stdout=log, stderr=log
        )
    try:
        with Client(f"http://127.0.0.1:{port}") as client:
            end = time.monotonic() + 60
            while True:
                assert process.poll() is None, (data.parent / "server.log").read_text()
                with contextlib.suppress(ClientError):
                    client.models()
                    break
                assert time.monotonic() < end
                time.sleep(0.05)
            yield process, client
    finally:
        process.kill()
        process.wait()


def session_ids(leader: int) -> list[int]:
    """The ids of the living processes of a session."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, _, number = path.read_text().rpartition(")")[2].split()[:4]
            if int(number) == leader and state != "Z":
                found.append(int(path.parent.name))
    return found


def session(leader: int) -> list[str]:
    """The command lines of the living processes of a session."""
    found = []
    for number in session_ids(leader):
        with contextlib.suppress(OSError):
            found.append(pathlib.Path(f"/proc/{number}/cmdline").read_text())
    return found


def until_empty(leader: int, seconds: float) -> None:
    end = time.monotonic() + seconds
    while left := session(leader):
        assert time.monotonic() < end, left
        time.sleep(0.01)


def until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.01)
