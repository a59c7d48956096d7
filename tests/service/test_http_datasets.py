"""POST and GET /v1/datasets: named by content and declarations, whole or not there."""

import asyncio
import hashlib
import io
import math
import os
import pathlib
import struct
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from fastapi import Request
from service_cases import csv_file
from starlette.testclient import TestClient

from service.app import create_app
from service.datasets import Datasets
from service.errors import ProblemError
from service.routes import _http
from service.settings import Settings


def test_a_file_becomes_a_dataset_with_a_report(http: TestClient, settings: Settings) -> None:
    content = csv_file()
    answer = http.post("/v1/datasets", content=content, params={"quantity": "brdf"})
    assert answer.status_code == 201
    dataset = answer.json()
    assert answer.headers["location"] == f"/v1/datasets/{dataset['id']}"
    assert dataset["bytes"] == len(content)
    assert dataset["sha256"] == hashlib.sha256(content).hexdigest()
    assert dataset["declared"] == {"format": None, "quantity": "brdf", "angle_unit": None, "columns": None}
    assert dataset["report"]["format"] == "csv"
    assert dataset["report"]["samples"] == 24
    assert dataset["report"]["masked"] == []
    assert http.get(answer.headers["location"]).json() == dataset
    assert (settings.data / "datasets" / dataset["id"] / "data").read_bytes() == content
    assert list((settings.data / "incoming").iterdir()) == []


def test_the_same_file_again_is_the_same_dataset(http: TestClient) -> None:
    first, second = (http.post("/v1/datasets", content=csv_file(), params={"quantity": "brdf"}) for _ in range(2))
    assert (first.status_code, second.status_code) == (201, 200)
    assert first.json() == second.json()
    assert first.headers["location"] == second.headers["location"]


def test_another_declaration_is_another_dataset(http: TestClient) -> None:
    ids = {
        http.post("/v1/datasets", content=csv_file(), params={"quantity": quantity}).json()["id"]
        for quantity in ("brdf", "brdf_cos", "reflectance_factor")
    }
    assert len(ids) == 3


def test_the_same_file_at_the_same_time_is_one_dataset(tmp_path: pathlib.Path) -> None:
    datasets = Datasets(tmp_path)
    declared = {"format": None, "quantity": "brdf", "angle_unit": None}

    def add(_: int) -> tuple[str, bool]:
        with datasets.incoming() as folder:
            (folder / "data").write_bytes(csv_file())
            dataset, new = datasets.add(folder, "0" * 64, declared, 2**20)
            return dataset.id, new

    with ThreadPoolExecutor(4) as pool:
        added = list(pool.map(add, range(8)))
    assert len({name for name, _ in added}) == 1
    assert sum(new for _, new in added) == 1


@pytest.mark.parametrize("kind", ["parquet", "arrow"])
def test_columns_of_equal_values_are_refused_before_they_are_unpacked(http: TestClient, kind: str) -> None:
    rows = 200_000
    names = ("theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", "value")
    table = pyarrow.table({name: np.full(rows, 0.5) for name in names}).replace_schema_metadata({"quantity": "brdf"})
    file = io.BytesIO()
    if kind == "parquet":
        pyarrow.parquet.write_table(table, file)
    else:
        options = pyarrow.ipc.IpcWriteOptions(compression="zstd")
        with pyarrow.ipc.new_file(file, table.schema, options=options) as writer:
            writer.write_table(table)
    assert len(file.getvalue()) < 2**20
    answer = http.post("/v1/datasets", content=file.getvalue())
    assert answer.status_code == 422, answer.text
    assert answer.json()["detail"].startswith("Expected a file of at most 131,072 numbers, got ")


def test_an_archive_of_much_is_refused_before_it_is_unpacked(http: TestClient, settings: Settings) -> None:
    out = io.BytesIO()
    np.savez_compressed(out, values=np.zeros(settings.upload_limit // 8))
    assert len(out.getvalue()) < settings.upload_limit // 100
    answer = http.post("/v1/datasets", content=out.getvalue())
    assert answer.status_code == 422
    size = settings.upload_limit + 128
    assert answer.json()["detail"].startswith(f"Expected an archive of at most 1048576 bytes unpacked, got {size}.")
    assert answer.json()["field"] == "body"


def test_what_was_masked_is_reported(http: TestClient) -> None:
    rows = csv_file().decode().splitlines()
    rows[3] = rows[3].rpartition(",")[0] + ","
    report = http.post("/v1/datasets", content="\n".join(rows), params={"quantity": "brdf"}).json()["report"]
    assert report["samples"] == 23
    assert [masked["count"] for masked in report["masked"]] == [1]
    assert report["masked"][0]["reason"]


def test_what_a_killed_server_left_is_cleared_away_after_a_day(tmp_path: pathlib.Path) -> None:
    for name, age in (("old", 25 * 3600), ("new", 60)):
        folder = tmp_path / "incoming" / name
        folder.mkdir(parents=True)
        (folder / "data").touch()
        os.utime(folder, (time.time() - age,) * 2)
    Datasets(tmp_path)
    assert [folder.name for folder in (tmp_path / "incoming").iterdir()] == ["new"]


def test_a_merl_file_is_streamed_and_its_invalid_bins_are_reported(tmp_path: pathlib.Path) -> None:
    bins = np.full((3, 90 * 90 * 180), 100.0)
    bins[:, ::7] = -1.0
    content = struct.pack("<3i", 90, 90, 180) + bins.tobytes()
    with TestClient(create_app(Settings(data=tmp_path, workers=1))) as http:
        pieces = (content[at : at + 2**20] for at in range(0, len(content), 2**20))
        report = http.post("/v1/datasets", content=pieces, params={"quantity": "brdf"}).json()["report"]
    assert (report["format"], report["channels"]) == ("merl", ["r", "g", "b"])
    masked = {entry["reason"]: entry["count"] for entry in report["masked"]}
    assert masked["value is negative, which MERL uses for invalid bins"] == bins.shape[1] // 7 + 1
    assert report["samples"] == bins.shape[1] - sum(masked.values())


def chunked(pieces: list[bytes], *, then: str) -> Request:
    """A request whose body comes in pieces and then stalls or breaks off."""
    left = list(pieces)

    async def receive() -> dict[str, Any]:
        if left:
            return {"type": "http.request", "body": left.pop(0), "more_body": True}
        if then == "stalls":
            await asyncio.sleep(60)
        return {"type": "http.disconnect"}

    return Request({"type": "http", "method": "POST", "path": "/", "headers": []}, receive)


@pytest.mark.parametrize(("then", "status"), [("stalls", 408), ("breaks off", 400)])
def test_a_body_that_does_not_end_is_refused(monkeypatch: pytest.MonkeyPatch, then: str, status: int) -> None:
    monkeypatch.setattr(_http, "_STALL", 0.05)

    async def whole() -> bytes:
        return b"".join([piece async for piece in _http.chunks(chunked([b"ab", b"c"], then=then), 100)])

    with pytest.raises(ProblemError, match=r"Send it again\.") as refused:
        asyncio.run(whole())
    assert refused.value.status_code == status


def test_what_no_fit_asks_for_is_removed_in_time(http: TestClient, settings: Settings) -> None:
    dataset = http.post("/v1/datasets", content=csv_file(), params={"quantity": "brdf"}).json()["id"]
    datasets = Datasets(settings.data)
    assert datasets.forget(time.time() - 60, lambda name: False) == 0
    assert datasets.forget(time.time() + 60, lambda name: name == dataset) == 0
    assert http.get(f"/v1/datasets/{dataset}").status_code == 200
    os.utime(settings.data / "datasets" / dataset, (0, 0))
    assert http.post("/v1/datasets", content=csv_file(), params={"quantity": "brdf"}).status_code == 200
    assert datasets.forget(time.time() - 60, lambda name: False) == 0  # as good as new
    assert datasets.forget(time.time() + 60, lambda name: False) == 1
    assert http.get(f"/v1/datasets/{dataset}").status_code == 404
    assert list((settings.data / "incoming").iterdir()) == []


def test_samples_come_back_in_degrees_as_the_brdf(http: TestClient) -> None:
    content = b"theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n60,0,20,180,0.1\n30,10,40,-170,0.2\n0,0,5,90,0.3\n"
    path = http.post("/v1/datasets", content=content, params={"quantity": "brdf_cos"}).headers["location"]
    found = http.get(f"{path}/samples").json()
    assert (found["count"], found["stride"], found["channels"]) == (3, 1, ["value"])
    assert found["theta_i_deg"] == pytest.approx([60, 30, 0])
    assert found["phi_i_deg"][:2] == pytest.approx([0, 10])
    assert found["theta_o_deg"] == pytest.approx([20, 40, 5])
    assert found["phi_o_deg"] == pytest.approx([180, -170, 90])
    divided = [0.1 / math.cos(math.radians(60)), 0.2 / math.cos(math.radians(30)), 0.3]
    assert [row[0] for row in found["values"]] == pytest.approx(divided)


def test_of_many_samples_every_nth_comes(http: TestClient) -> None:
    path = http.post("/v1/datasets", content=csv_file(24), params={"quantity": "brdf"}).headers["location"]
    every, some = (http.get(f"{path}/samples", params={"limit": limit}).json() for limit in (24, 7))
    assert (every["stride"], some["stride"], len(some["values"])) == (1, 4, 6)
    assert some["values"] == every["values"][::4]
    assert http.get(f"{path}/samples", params={"limit": 10_001}).status_code == 422
    assert http.get("/v1/datasets/none/samples").json()["detail"].startswith("Expected the id of an uploaded dataset")
