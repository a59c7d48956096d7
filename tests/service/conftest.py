"""An app with its own data folder."""

import pathlib
from collections.abc import Iterator
from typing import Any

import pytest
from service_cases import idling, measured_diffuser
from starlette.testclient import TestClient

from service.app import create_app
from service.settings import Settings


@pytest.fixture
def settings(tmp_path: pathlib.Path) -> Settings:
    return Settings(data=tmp_path / "data", workers=1, upload_limit=2**20, inline_rows=100)


@pytest.fixture
def http(settings: Settings) -> Iterator[TestClient]:
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        yield client


@pytest.fixture
def idle_settings(settings: Settings) -> Settings:
    """What `idle` is set to; test files that need something else have a fixture of this name."""
    return settings


@pytest.fixture
def idle(idle_settings: Settings) -> Iterator[TestClient]:
    """A client of an app whose dispatcher never starts, so that jobs stay queued."""
    with idling(idle_settings) as client:
        yield client


@pytest.fixture
def request_body() -> dict[str, Any]:
    return {"samples": measured_diffuser(), "model": "lambert"}
