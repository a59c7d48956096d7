"""Keys, headers, logs and counts: what every request meets."""

import dataclasses
import io
import json
import logging
import pathlib
import re
from collections.abc import Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from brdfcore.errors import InvalidValueError
from service import keys
from service.app import create_app
from service.guard import HEADER_LIMIT, OPEN
from service.log import JsonLines
from service.settings import Settings

KEY, OTHER = "k" * 24, "another-long-key-0123456789"


@pytest.fixture
def locked(settings: Settings) -> Iterator[TestClient]:
    """A client, without a key, of a service that needs one."""
    closed = dataclasses.replace(settings, api_keys=keys.hashes(f"{KEY}, sha256:{keys.hash_of(OTHER)}"), queue_limit=1)
    with TestClient(create_app(closed), raise_server_exceptions=False) as client:
        yield client


def bearer(key: str) -> dict[str, str]:
    return {"authorization": f"Bearer {key}"}


def test_no_route_but_health_answers_without_a_key(locked: TestClient) -> None:
    paths = locked.get("/openapi.json", headers=bearer(KEY)).json()["paths"]
    for path, operations in paths.items():
        for method in operations:
            answer = locked.request(method, re.sub(r"\{\w+\}", "0", path))
            if path in OPEN:
                assert answer.status_code == 200
            else:
                assert answer.status_code == 401, (method, path)
                assert answer.headers["www-authenticate"] == "Bearer"
                assert answer.json()["detail"].startswith("Expected a known API key.")
    assert OPEN == ("/", "/docs", "/healthz", "/readyz")
    assert locked.get("/openapi.json").status_code == 401
    assert locked.get("/nowhere").status_code == 401


@pytest.mark.parametrize("header", ["Bearer", "Bearer ", f"Basic {KEY}", f"Bearer {KEY}x", KEY, "Bearer sha256:00"])
def test_what_is_no_known_key_is_refused(locked: TestClient, header: str) -> None:
    assert locked.get("/v1/models", headers={"authorization": header}).status_code == 401


@pytest.mark.parametrize("key", [KEY, OTHER])
def test_a_known_key_is_let_in(locked: TestClient, key: str) -> None:
    assert locked.get("/v1/models", headers=bearer(key)).status_code == 200


def test_keys_are_kept_as_hashes() -> None:
    settings = Settings(api_keys=keys.hashes(KEY))
    assert KEY not in repr(settings)
    assert settings.api_keys == (keys.hash_of(KEY),)
    assert keys.hashes(f"{KEY} {KEY},sha256:{keys.hash_of(KEY)}") == (keys.hash_of(KEY),)
    assert Settings.from_environment({"BRDF_API_KEYS": KEY}).api_keys == (keys.hash_of(KEY),)


@pytest.mark.parametrize("text", ["short", "", "sha256:abc", "tab\x7f" + KEY, "é" * 20])
def test_a_key_that_is_none_is_refused_without_being_shown(text: str) -> None:
    with pytest.raises(InvalidValueError, match="Expected each API key to be 16 or more") as refused:
        keys.hashes(text)
    assert not text or text not in str(refused.value)


def test_a_key_stands_in_no_file_log_or_answer(
    locked: TestClient, settings: Settings, request_body: dict[str, Any], caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG):
        locked.post("/v1/fits", json=request_body, headers=bearer(KEY) | {"prefer": "wait=20"})
        answer = locked.get("/v1/models", headers=bearer(KEY + "wrong"))
    assert KEY not in answer.text
    assert KEY not in caplog.text + "".join(str(record.__dict__) for record in caplog.records)
    for file in settings.data.rglob("*"):
        assert not file.is_file() or KEY.encode() not in file.read_bytes(), file


def test_the_queue_of_a_key_is_its_own(settings: Settings, request_body: dict[str, Any], idle: TestClient) -> None:
    def post(key: str, model: str) -> int:
        return idle.post("/v1/fits", json=request_body | {"model": model}, headers=bearer(key)).status_code

    assert [post(KEY, "lambert"), post(KEY, "ward_bounded")] == [202, 429]
    assert post(OTHER, "lambert") == 202


@pytest.fixture
def idle_settings(settings: Settings) -> Settings:
    return dataclasses.replace(settings, api_keys=keys.hashes(f"{KEY},{OTHER}"), queue_limit=1)


def test_open_to_other_machines_only_with_a_key(tmp_path: pathlib.Path) -> None:
    Settings(data=tmp_path).check_open()
    Settings(data=tmp_path, host="0.0.0.0", api_keys=keys.hashes(KEY)).check_open()
    with pytest.raises(InvalidValueError, match=r"Expected an API key, since 0\.0\.0\.0 is open to other machines"):
        Settings(data=tmp_path, host="0.0.0.0").check_open()


def test_every_answer_carries_its_id_and_the_security_headers(
    http: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.jobs.store.JobStore.newest", lambda *a, **k: 1 / 0)
    for path, status in (("/healthz", 200), ("/nowhere", 404), ("/v1/fits", 500)):
        answer = http.get(path, headers={"x-request-id": "from-a-proxy.1"})
        assert answer.status_code == status
        assert answer.headers["x-request-id"] == "from-a-proxy.1"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert "default-src 'none'" in answer.headers["content-security-policy"]
    made = http.get("/healthz", headers={"x-request-id": "no id\x7f"}).headers["x-request-id"]
    assert re.fullmatch("[0-9a-f]{32}", made)


def test_without_a_key_a_server_answers_to_its_own_names_only(settings: Settings) -> None:
    app = create_app(settings)
    app.state.hosts = ("127.0.0.1", "[::1]")
    with TestClient(app) as client:
        for host in ("127.0.0.1", "127.0.0.1:8000", "[::1]:8000"):
            assert client.get("/v1/models", headers={"host": host}).status_code == 200
        for host in ("evil.example", "evil.example:8000", "127.0.0.1.evil.example", ""):
            answer = client.get("/v1/models", headers={"host": host})
            assert answer.status_code == 421
            assert answer.json()["detail"].startswith(f"Expected Host to be 127.0.0.1 or [::1], got {host!r}")


def test_headers_are_bounded(http: TestClient) -> None:
    answer = http.get("/healthz", headers={"x-long": "a" * HEADER_LIMIT})
    assert answer.status_code == 431
    assert answer.json()["detail"].startswith(f"Expected headers of at most {HEADER_LIMIT} bytes, got ")


def test_a_request_is_one_json_line(http: TestClient) -> None:
    written = io.StringIO()
    handler = logging.StreamHandler(written)
    handler.setFormatter(JsonLines())
    log = logging.getLogger("service.requests")
    log.addHandler(handler)
    log.setLevel("INFO")
    try:
        http.get("/v1/fits/none", headers={"x-request-id": "abc"}, params={"secret": "x"})
    finally:
        log.removeHandler(handler)
        log.setLevel("NOTSET")
    said = json.loads(written.getvalue())
    assert (said["request_id"], said["method"], said["path"], said["status"]) == ("abc", "GET", "/v1/fits/none", 404)
    assert said["milliseconds"] > 0
    assert "secret" not in written.getvalue()


def test_an_exception_is_one_json_line_too() -> None:
    try:
        raise ValueError("two\nlines")
    except ValueError as error:
        record = logging.LogRecord("service", logging.ERROR, "", 0, "failed", (), (type(error), error, None))
    line = JsonLines().format(record)
    assert "\n" not in line
    assert "ValueError: two\nlines" in json.loads(line)["exception"]


def test_metrics_count_requests_jobs_and_failures(http: TestClient, request_body: dict[str, Any]) -> None:
    http.post("/v1/fits", json=request_body, headers={"prefer": "wait=20"})
    http.post("/v1/fits", json=request_body | {"model": None, "models": ["lambert"]}, headers={"prefer": "wait=20"})
    steep = request_body | {"max_theta_deg": 0.01}
    failed = http.post("/v1/fits", json=steep, headers={"prefer": "wait=20"}).json()
    assert failed["status"] == "failed"
    for method in ("INVENTED", "MADE-UP"):
        assert http.request(method, "/v1/fits").status_code == 405
    text = http.get("/metrics").text
    assert "INVENTED" not in text
    for line in (
        'brdf_request_seconds_count{method="other",route="/v1/fits",status="405"} 2.0',
        'brdf_jobs{kind="fit",status="succeeded"} 2.0',
        'brdf_jobs{kind="fit",status="failed"} 1.0',
        "brdf_queue_depth 0.0",
        'brdf_job_seconds_count{kind="fit",model="lambert"} 1.0',
        'brdf_job_seconds_count{kind="fit",model="several"} 1.0',
        'brdf_job_failures_total{kind="fit",reason="data"} 1.0',
        'brdf_request_seconds_count{method="POST",route="/v1/fits",status="200"} 3.0',
    ):
        assert line in text, line


def test_large_answers_travel_compressed_where_that_helps(http: TestClient, request_body: dict[str, Any]) -> None:
    large = http.get("/openapi.json")
    assert large.headers["content-encoding"] == "gzip"
    assert int(large.headers["content-length"]) < len(large.content) / 4
    assert "content-encoding" not in http.get("/openapi.json", headers={"accept-encoding": "identity"}).headers
    assert "content-encoding" not in http.get("/healthz").headers
    fit = http.post("/v1/fits", json=request_body, headers={"prefer": "wait=20"}).json()["id"]
    events = http.get(f"/v1/fits/{fit}/events", headers={"accept": "text/event-stream"})
    image = http.get(f"/v1/fits/{fit}/plots/lobes.png")
    drawing = http.get(f"/v1/fits/{fit}/plots/lobes.svg")
    assert [one.headers.get("content-encoding") for one in (events, image, drawing)] == [None, None, "gzip"]
    again = http.get(f"/v1/fits/{fit}/plots/lobes.svg", headers={"if-none-match": drawing.headers["etag"]})
    assert again.status_code == 304
