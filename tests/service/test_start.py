"""What a server says when it starts: a sentence where it cannot, JSON lines where it can."""

import json
import logging
import pathlib
import sqlite3
import sys
from collections.abc import Iterator

import pytest

from brdfcore.errors import InvalidValueError
from service.app import server
from service.settings import Settings


@pytest.fixture(autouse=True)
def _loggers() -> Iterator[None]:
    """The log of this process as it was."""
    logs = [logging.getLogger(name) for name in ("service", "uvicorn", "asyncio")]
    before = [(log.handlers, log.propagate, log.level) for log in logs]
    yield
    for log, (handlers, propagate, level) in zip(logs, before, strict=True):
        log.handlers, log.propagate, log.level = handlers, propagate, level


def test_what_cannot_be_started_is_told_before_it_starts(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InvalidValueError, match="Expected the package ray to be installed"):
        server(Settings(data=tmp_path / "new", ray_address="auto"))
    with sqlite3.connect(tmp_path / "new" / "jobs.sqlite3") as db:
        db.execute("PRAGMA user_version = 1")
    with pytest.raises(InvalidValueError, match=r"Expected jobs\.sqlite3 to be of this version"):
        server(Settings(data=tmp_path / "new"))
    (tmp_path / "jobs.sqlite3").write_text("the jobs of another program, long enough to have a header" * 20)
    with pytest.raises(InvalidValueError, match=r"Expected .* to be a job store that can be written, got: file is not"):
        server(Settings(data=tmp_path))


def test_every_line_of_the_log_is_json(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("service.app._runner", lambda settings: None)
    made = server(Settings(data=tmp_path))
    assert list(made.config.app.state.hosts) == ["127.0.0.1", "localhost", "[::1]"]  # type: ignore[union-attr]
    made.config.load()
    logging.getLogger("uvicorn.error").warning("Invalid HTTP request received.")
    logging.getLogger("uvicorn.access").info("GET / 200")
    logging.getLogger("service.jobs").error("a job raised")
    said = [json.loads(line)["message"] for line in capsys.readouterr().err.splitlines()]
    assert said == ["Invalid HTTP request received.", "a job raised"]
