"""A full disk: what comes in is refused in words, what was accepted is done once there is room again."""

import errno
import json
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
from typing import Any

import pytest
from service_cases import csv_file
from starlette.testclient import TestClient

from service import datasets
from service.jobs import work
from service.jobs.store import JobStore

HERE = pathlib.Path(__file__).parent


def sqlite_error(code: int) -> sqlite3.OperationalError:
    error = sqlite3.OperationalError("refused")
    error.sqlite_errorcode = code
    return error


def raising(error: Exception) -> Any:
    def fail(*arguments: object, **keywords: object) -> None:
        raise error

    return fail


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (sqlite_error(sqlite3.SQLITE_FULL), 507, "no room left on its disk"),
        (OSError(errno.EDQUOT, "quota"), 507, "no room left on its disk"),
        (sqlite_error(sqlite3.SQLITE_BUSY), 503, "too busy"),
        (sqlite_error(sqlite3.SQLITE_IOERR), 500, "Its log has the details"),
        (OSError(errno.EIO, "broken"), 500, "Its log has the details"),
    ],
)
def test_what_cannot_be_kept_is_refused(
    http: TestClient, request_body: dict[str, Any], monkeypatch: pytest.MonkeyPatch, error: Any, status: int, words: str
) -> None:
    monkeypatch.setattr(JobStore, "submit", raising(error))
    answer = http.post("/v1/fits", json=request_body)
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json")
    assert words in answer.json()["detail"]
    assert answer.headers.get("retry-after") == ("1" if status == 503 else None)


def test_an_upload_that_does_not_fit_leaves_nothing(http: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(datasets, "_to_disk", raising(OSError(errno.ENOSPC, "full")))
    assert http.post("/v1/datasets", content=csv_file(), params={"quantity": "brdf"}).status_code == 507
    folder = http.app.state.settings.data  # type: ignore[attr-defined]
    assert [list((folder / name).iterdir()) for name in ("incoming", "datasets")] == [[], []]


def test_an_attempt_that_finds_the_disk_full_is_not_the_job_s_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(work._WORK, "albedo_table", raising(OSError(errno.ENOSPC, "full")))
    said: list[tuple[str, ...]] = []
    work.answer(said.append, pathlib.Path(), "albedo_table", b"", 2**33)
    assert said == [("interrupted", "found the disk full")]


def can_mount() -> bool:
    """Whether this process may have a file system of its own."""
    tried = ["unshare", "-m", "mount", "-t", "tmpfs", "none", "/mnt"]
    return shutil.which("unshare") is not None and subprocess.run(tried, capture_output=True).returncode == 0


@pytest.mark.full
@pytest.mark.skipif(not can_mount(), reason="needs a mount namespace of its own: unshare -m")
def test_a_real_one_loses_nothing(tmp_path: pathlib.Path) -> None:
    script = ["unshare", "-m", sys.executable, str(HERE / "full_disk.py"), str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([*sys.path, str(HERE)])}
    ran = subprocess.run(script, capture_output=True, text=True, env=environment, timeout=300)
    assert ran.returncode == 0, ran.stderr[-3000:]
    told = json.loads(ran.stdout)
    assert told["filled"] == errno.ENOSPC
    assert [status for status, _ in told["refused"]] == [507, 507]  # an upload, and a fit
    assert all("no room left on its disk" in detail for _, detail in told["refused"])
    assert (told["alive"], told["read"]) == ([200, 200, 200], 200)
    assert (told["same server"], told["statuses"], told["left"]) == (True, ["succeeded"], [])
    assert (told["integrity"], told["kept"], told["committed_once"]) == ([["ok"]], True, True)
