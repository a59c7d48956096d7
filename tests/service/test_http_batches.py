"""Batches: several models fitted to many datasets, one progress, one table; all of it or nothing is accepted."""

import csv
import dataclasses
import io
import time
from typing import Any

import pytest
from service_cases import KD, csv_file
from starlette.testclient import TestClient

from service.client import Client, WaitError
from service.settings import Settings


@pytest.fixture
def datasets(http: TestClient) -> list[str]:
    """Three uploads of different sizes."""
    return [upload(http, rows) for rows in (24, 25, 26)]


def upload(http: TestClient, rows: int) -> str:
    return str(http.post("/v1/datasets", content=csv_file(rows), params={"quantity": "brdf"}).json()["id"])


def finished(http: TestClient, batch: dict[str, Any]) -> dict[str, Any]:
    end = time.monotonic() + 30
    while not (batch := http.get(f"/v1/batches/{batch['id']}").json())["finished"]:
        assert time.monotonic() < end
        time.sleep(0.02)
    return batch


def test_every_model_is_fitted_to_every_dataset(http: TestClient, datasets: list[str]) -> None:
    body = {"datasets": datasets, "models": ["lambert", "lambert + ward_bounded"], "loss": "l2"}
    answer = http.post("/v1/batches", json=body)
    assert answer.status_code == 202
    batch = answer.json()
    assert answer.headers["location"] == f"/v1/batches/{batch['id']}"
    assert answer.headers["retry-after"] == "1"
    assert (batch["datasets"], batch["models"], sum(batch["counts"].values())) == (3, body["models"], 6)
    done = finished(http, batch)
    assert (done["counts"], done["fraction"]) == ({"succeeded": 6}, 1.0)
    rows = http.get(f"/v1/batches/{batch['id']}/table").json()["rows"]
    assert [(row["dataset"], row["model"]) for row in rows] == [(d, m) for d in datasets for m in body["models"]]
    for row in rows:
        assert row["errors"]["l2"] < 0.01
        fit = http.get(f"/v1/fits/{row['fit']}").json()
        assert (fit["result"]["loss"], fit["result"]["errors"]) == ("l2", row["errors"])
    text = http.get(f"/v1/batches/{batch['id']}/table", headers={"accept": "text/csv"}).text
    table = list(csv.DictReader(io.StringIO(text)))
    assert float(table[0]["lambert.kd"]) == pytest.approx(KD, rel=0.01)
    assert table[0]["ward_bounded.a"] == ""
    assert [item["id"] for item in http.get("/v1/batches").json()["items"]] == [batch["id"]]
    again = http.post("/v1/batches", json=body).json()
    assert again["finished"]
    assert http.delete(f"/v1/batches/{batch['id']}").status_code == 204
    assert http.get(f"/v1/batches/{batch['id']}").status_code == 404
    assert http.get(f"/v1/fits/{rows[0]['fit']}").status_code == 404


@pytest.mark.parametrize(
    ("change", "field", "part"),
    [
        ({"datasets": ["0" * 64]}, "datasets[0]", "to be the id of an uploaded dataset"),
        ({"models": ["lambrt"]}, "model", "Did you mean 'lambert'"),
        ({"models": ["lambert", "lambert"]}, "body", "models to be given once each"),
        ({"models": []}, "models", "at least 1"),
        ({"optimizer": "newton"}, "optimizer", "least_squares"),
    ],
)
def test_all_is_checked_before_any_is_accepted(
    http: TestClient, datasets: list[str], change: dict[str, Any], field: str, part: str
) -> None:
    answer = http.post("/v1/batches", json={"datasets": datasets, "models": ["lambert"]} | change)
    assert (answer.status_code, answer.json()["field"]) == (422, field)
    assert part in answer.json()["detail"]
    assert http.get("/v1/fits").json()["items"] == []


@pytest.fixture
def idle_settings(settings: Settings) -> Settings:
    return dataclasses.replace(settings, queue_limit=3)


def test_a_batch_is_accepted_whole_or_not_at_all(idle: TestClient) -> None:
    names = [upload(idle, rows) for rows in (24, 25, 26, 27)]
    answer = idle.post("/v1/batches", json={"datasets": names, "models": ["lambert"]})
    assert (answer.status_code, answer.headers["retry-after"]) == (429, "10")
    assert idle.get("/v1/fits").json()["items"] == []
    assert idle.get("/v1/batches").json()["items"] == []
    body = {"datasets": names[:3], "models": ["lambert"]}
    first, again = (idle.post("/v1/batches", json=body, headers={"idempotency-key": "k"}) for _ in range(2))
    assert first.json()["id"] == again.json()["id"]
    other = idle.post("/v1/batches", json=body | {"seed": 1}, headers={"idempotency-key": "k"})
    assert other.status_code == 409
    cancelled = idle.post(f"/v1/batches/{first.json()['id']}/cancel").json()
    assert (cancelled["counts"], cancelled["finished"]) == ({"cancelled": 3}, True)


def test_a_fit_that_still_runs_is_not_all_of_its_work(idle: TestClient) -> None:
    body = {"datasets": [upload(idle, 24)], "models": ["lambert", "ward_bounded"]}
    batch = idle.post("/v1/batches", json=body).json()
    store = idle.app.state.service.store  # type: ignore[attr-defined]
    for expected in (0.495, 0.99):
        assert store.progress(store.claim(), '{"stage": "fit", "fraction": 1.0, "loss": null}')
        view = idle.get(f"/v1/batches/{batch['id']}").json()
        assert (view["finished"], view["fraction"]) == (False, pytest.approx(expected))


def test_lists_are_paged(idle: TestClient) -> None:
    names = [upload(idle, rows) for rows in (24, 25, 26)]
    made = [idle.post("/v1/batches", json={"datasets": [n], "models": ["lambert"]}).json()["id"] for n in names]
    first = idle.get("/v1/batches", params={"limit": 2}).json()
    assert [item["id"] for item in first["items"]] == made[:0:-1]
    rest = idle.get("/v1/batches", params={"cursor": first["next"]}).json()
    assert ([item["id"] for item in rest["items"]], rest["next"]) == (made[:1], None)
    assert idle.get("/v1/batches/none").status_code == 404
    assert idle.delete("/v1/batches/none").status_code == 404


def test_the_client_s_batch(http: TestClient, tmp_path: Any) -> None:
    paths = []
    for rows in (24, 25):
        paths.append(tmp_path / f"{rows}.csv")
        paths[-1].write_bytes(csv_file(rows))
    with Client("http://testserver", transport=http._transport) as client:
        told: list[float] = []
        batch = client.batch(paths, models=["lambert"], quantity="brdf", seed=3)
        batch.wait(30, progress=lambda now: told.append(now.fraction))
        assert told[-1] == 1.0
        assert [row.status for row in batch.rows()] == ["succeeded"] * 2
        assert batch.csv().startswith("dataset,model,fit,status")
        assert repr(client.get_batch(batch.id)) == f"BatchResult({batch.id}, {{'succeeded': 2}})"
        batch.delete()


def test_waiting_for_a_batch_ends_with_its_time(idle: TestClient) -> None:
    with Client("http://testserver", transport=idle._transport) as client:
        dataset = idle.post("/v1/datasets", content=csv_file(), params={"quantity": "brdf"}).json()["id"]
        made = idle.post("/v1/batches", json={"datasets": [dataset], "models": ["lambert"]}).json()
        with pytest.raises(WaitError, match=r"to be finished within 0\.05 s, but it is not"):
            client.get_batch(made["id"]).wait(0.05)
        assert client.get_batch(made["id"]).cancel().refresh().view.finished
