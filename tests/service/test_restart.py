"""A real server process: killed, restarted, told to end; accepted fits survive and no process stays behind."""

import contextlib
import os
import pathlib
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator

import pytest
from service_cases import measured_diffuser

from service.client import Client, ClientError
from service.jobs.store import JobStore

SERVE = """
from service.app import server
from service.settings import Settings
server(Settings.from_environment()).run()
"""
SLOW = {"model": "lambert + kurt"}  # long enough for a kill to find it running


@contextlib.contextmanager
def server(data: pathlib.Path) -> Iterator[tuple[subprocess.Popen[bytes], Client]]:
    """A server of that data folder with one worker, in a session of its own, and a client of it."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    environment = os.environ | {"BRDF_DATA": str(data), "BRDF_PORT": str(port), "BRDF_WORKERS": "1"}
    with (data.parent / "server.log").open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, "-c", SERVE], env=environment, start_new_session=True, stdout=log, stderr=log
        )
    try:
        with Client(f"http://127.0.0.1:{port}") as client:
            end = time.monotonic() + 30
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


def session(leader: int) -> list[str]:
    """The living processes of a session."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, _, number = path.read_text().rpartition(")")[2].split()[:4]
            if int(number) == leader and state != "Z":
                found.append(path.parent.joinpath("cmdline").read_text())
    return found


def until_empty(leader: int, seconds: float) -> None:
    end = time.monotonic() + seconds
    while left := session(leader):
        assert time.monotonic() < end, left
        time.sleep(0.01)


def until(condition: Callable[[], object], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.01)


def test_fits_survive_a_killed_server(tmp_path: pathlib.Path) -> None:
    data = tmp_path / "data"
    with server(data) as (process, client):
        first = client.fit(measured_diffuser(200), wait=False, **SLOW)
        second = client.fit(measured_diffuser(), model="lambert", wait=False)
        until(lambda: first.refresh().job_status == "running")
        assert second.refresh().job_status == "queued"
        process.kill()
        process.wait()
        until_empty(process.pid, seconds=5)
    with server(data) as (process, client):
        fits = [client.get(fit.id).wait(timeout=60) for fit in (first, second)]
        assert [fit.view.attempts for fit in fits] == [2, 1]
        assert fits[1].status == "converged"
        assert [fit.id for fit in fits[::-1]] == [fit.id for fit in client.recent()]


def test_sigterm_ends_at_once_and_keeps_the_fits(tmp_path: pathlib.Path) -> None:
    data = tmp_path / "data"
    answers: list[str] = []
    with server(data) as (process, client):

        def wait() -> None:
            answer = client._http.post(
                "/v1/fits",
                json={"samples": measured_diffuser(2000), "optimizer": "adam", **SLOW},
                headers={"prefer": "wait=60"},
            )
            answers.append(f"{answer.status_code} {answer.json()['status']}")

        waiting = threading.Thread(target=wait)
        waiting.start()
        until(lambda: [fit.status for fit in client.recent()] == ["running"])
        begun = time.monotonic()
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=5)
        until_empty(process.pid, seconds=5 - (time.monotonic() - begun))
        waiting.join(timeout=5)
    assert answers == ["202 running"]
    store = JobStore(data / "jobs.sqlite3")
    assert [job.status for job in store.newest(10)] == ["queued"]
    store.close()


def test_uploads_that_are_too_large_or_break_off_leave_nothing(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BRDF_UPLOAD_LIMIT", str(2**20))
    data = tmp_path / "data"
    with server(data) as (_, client):
        pieces = [bytes(2**16)] * 128
        for content in (b"".join(pieces), iter(pieces)):  # with and without a length told beforehand
            answer = client._http.post("/v1/datasets", content=content)
            assert answer.status_code == 413
            assert answer.headers["content-type"] == "application/problem+json"
        with socket.create_connection((client._http.base_url.host, client._http.base_url.port or 0)) as broken:
            broken.sendall(b"POST /v1/datasets HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n0123456789")
            until(lambda: list((data / "incoming").iterdir()))
        until(lambda: not list((data / "incoming").iterdir()))
    assert list((data / "datasets").iterdir()) == []
    assert "Traceback" not in (tmp_path / "server.log").read_text()
