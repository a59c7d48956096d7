"""The same work is done once: idempotency keys, reuse of earlier results; progress as events; lists by status."""

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from starlette.testclient import TestClient

from service.jobs.store import JobStore

Body = dict[str, Any]
WAIT = {"prefer": "wait=20"}


def test_a_hundred_posts_with_one_key_make_one_fit(idle: TestClient, request_body: Body) -> None:
    def post(_: int) -> tuple[int, str]:
        answer = idle.post("/v1/fits", json=request_body, headers={"idempotency-key": "once"})
        return answer.status_code, answer.json()["id"]

    with ThreadPoolExecutor(8) as pool:
        answers = set(pool.map(post, range(100)))
    assert len(answers) == 1
    assert len(idle.get("/v1/fits").json()["items"]) == 1


def test_a_key_that_came_with_another_body_is_refused(idle: TestClient, request_body: Body) -> None:
    headers = {"idempotency-key": "once"}
    assert idle.post("/v1/fits", json=request_body, headers=headers).status_code == 202
    answer = idle.post("/v1/fits", json=request_body | {"seed": 1}, headers=headers)
    assert (answer.status_code, answer.json()["field"]) == (409, "Idempotency-Key")
    assert "got another" in answer.json()["detail"]
    table = {"material": "ward_bounded", "axes": {"ward_bounded.a": [0.1, 0.2]}}
    assert idle.post("/v1/albedo", json=table, headers=headers).status_code == 202  # a key is of one kind of job
    long = idle.post("/v1/fits", json=request_body, headers={"idempotency-key": "x" * 256})
    assert (long.status_code, long.json()["field"]) == (422, "Idempotency-Key")


def test_work_that_was_done_is_answered_from_the_earlier_result(http: TestClient, request_body: Body) -> None:
    first = http.post("/v1/fits", json=request_body, headers=WAIT).json()
    again = http.post("/v1/fits", json=request_body)
    assert again.status_code == 200
    assert again.json()["id"] != first["id"]
    assert (first["reused"], again.json()["reused"]) == (None, first["id"])
    assert again.json()["result"] == first["result"]
    assert http.delete(f"/v1/fits/{first['id']}").status_code == 204
    assert http.get(f"/v1/fits/{again.json()['id']}").json()["result"] == first["result"]


@pytest.mark.parametrize("change", [{"seed": 1}, {"model": "ward_bounded"}, {"loss": "log"}, {"max_theta_deg": 85}])
def test_other_work_is_done(http: TestClient, request_body: Body, change: Body) -> None:
    first = http.post("/v1/fits", json=request_body, headers=WAIT).json()
    other = http.post("/v1/fits", json=request_body | change, headers=WAIT).json()
    assert first["status"] == other["status"] == "succeeded"
    assert other["reused"] is None


def test_other_samples_are_other_work(http: TestClient, request_body: Body) -> None:
    http.post("/v1/fits", json=request_body, headers=WAIT)
    turned = json.loads(json.dumps(request_body))
    turned["samples"]["azimuth_observed"] = True
    assert http.post("/v1/fits", json=turned, headers=WAIT).json()["reused"] is None
    turned["samples"]["values"][0][0] *= 1.5
    assert http.post("/v1/fits", json=turned, headers=WAIT).json()["reused"] is None


def test_lists_are_by_status(idle: TestClient, request_body: Body) -> None:
    idle.post("/v1/fits", json=request_body)
    for status, count in (("queued", 1), ("succeeded", 0)):
        items = idle.get("/v1/fits", params={"status": status}).json()["items"]
        assert [item["status"] for item in items] == [status] * count
    assert idle.get("/v1/fits", params={"status": "lost"}).status_code == 422


def events(http: TestClient, path: str, **headers: str) -> list[dict[str, Any]]:
    """The events of a stream that ends."""
    answer = http.get(path, headers={"accept": "text/event-stream", **headers})
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/event-stream")
    found = []
    for block in answer.text.strip().split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.split("\n") if not line.startswith(":"))
        found.append({"event": fields["event"], "id": fields["id"], **json.loads(fields["data"])})
    return found


def test_progress_is_told_as_events(http: TestClient, request_body: Body) -> None:
    fit = http.post("/v1/fits", json=request_body | {"model": "lambert + kurt"}).json()
    told = events(http, f"/v1/fits/{fit['id']}/events")
    assert [event["event"] for event in told[:-1]] == ["progress"] * (len(told) - 1)
    assert (told[-1]["event"], told[-1]["status"]) == ("succeeded", "succeeded")
    assert told[-1]["progress"]["fraction"] == 1
    fractions = [event["progress"]["fraction"] for event in told if event["progress"]]
    assert fractions == sorted(fractions)
    again = events(http, f"/v1/fits/{fit['id']}/events", **{"last-event-id": told[-1]["id"]})
    assert [event["event"] for event in again] == ["succeeded"]


def test_events_end_when_the_fit_is_cancelled_or_removed(
    idle: TestClient, request_body: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    fit = idle.post("/v1/fits", json=request_body).json()
    with ThreadPoolExecutor(1) as pool:
        told = pool.submit(events, idle, f"/v1/fits/{fit['id']}/events")
        idle.post(f"/v1/fits/{fit['id']}/cancel")
        assert told.result(20)[-1]["event"] == "cancelled"
    fit = idle.post("/v1/fits", json=request_body).json()
    found = [JobStore.get, lambda self, job_id: None]  # there when it is asked for, then gone
    monkeypatch.setattr(JobStore, "get", lambda self, job_id: found.pop(0)(self, job_id) if found else None)
    assert [event["event"] for event in events(idle, f"/v1/fits/{fit['id']}/events")] == ["progress", "cancelled"]


def test_events_are_of_a_fit_and_must_be_acceptable(http: TestClient) -> None:
    assert http.get("/v1/fits/none/events", headers={"accept": "text/event-stream"}).status_code == 404
    assert http.get("/v1/fits/none/events", headers={"accept": "application/json"}).status_code == 406
    assert http.get("/v1/albedo/none/events", headers={"accept": "text/event-stream"}).status_code == 404
