"""Real server processes: one is killed, the next goes on, and told to end it does so at once; nothing stays behind."""

import pathlib
import signal
import socket
import subprocess
import threading
import time

import pytest
from service_cases import measured_diffuser
from service_process import SLOW, server, until, until_empty

from service.client import Client
from service.jobs.store import JobStore


def test_a_service_is_killed_comes_back_and_is_told_to_end(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One test, because a server takes seconds to start."""
    monkeypatch.setenv("BRDF_UPLOAD_LIMIT", str(2**20))
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
        uploads_that_are_too_large_or_break_off_leave_nothing(client, data)
        sigterm_ends_at_once(process, client)
    assert "Traceback" not in (tmp_path / "server.log").read_text()
    store = JobStore(data / "jobs.sqlite3")
    assert [job.status for job in store.newest(10)] == ["queued", "succeeded", "succeeded"]
    store.close()


def uploads_that_are_too_large_or_break_off_leave_nothing(client: Client, data: pathlib.Path) -> None:
    pieces = [bytes(2**16)] * 128
    for content in (b"".join(pieces), iter(pieces)):  # with and without a length told beforehand
        answer = client._http.post("/v1/datasets", content=content)
        assert answer.status_code == 413
        assert answer.headers["content-type"] == "application/problem+json"
    with socket.create_connection((client._http.base_url.host, client._http.base_url.port or 0)) as broken:
        broken.sendall(b"POST /v1/datasets HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n0123456789")
        until(lambda: list((data / "incoming").iterdir()))
    until(lambda: not list((data / "incoming").iterdir()))
    assert list((data / "datasets").iterdir()) == []


def sigterm_ends_at_once(process: "subprocess.Popen[bytes]", client: Client) -> None:
    """And who waits for a fit is answered as it stands."""
    answers: list[str] = []
    body = {"samples": measured_diffuser(2000), "optimizer": "adam", **SLOW}

    def wait() -> None:
        answer = client._http.post("/v1/fits", json=body, headers={"prefer": "wait=60"})
        answers.append(f"{answer.status_code} {answer.json()['status']}")

    waiting = threading.Thread(target=wait)
    waiting.start()
    until(lambda: [fit.status for fit in client.recent(1)] == ["running"])
    begun = time.monotonic()
    process.send_signal(signal.SIGTERM)
    process.wait(timeout=5)
    until_empty(process.pid, seconds=5 - (time.monotonic() - begun))
    waiting.join(timeout=5)
    assert answers == ["202 running"]
