"""Bad input: each a 4xx problem document whose sentence names the field and says what to do."""

import copy
import io
import json
import math
import pathlib
import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from service_cases import csv_file, measured_diffuser
from starlette.testclient import TestClient

from service.datasets import Datasets
from service.settings import Settings

Body = dict[str, Any]


def problem_of(answer: Any, status: int) -> dict[str, Any]:
    """The problem document of an answer, whose form is checked."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["type"] == "about:blank"
    assert problem["status"] == status
    assert problem["title"]
    assert problem["detail"].endswith((".", "]"))
    assert "Traceback" not in answer.text
    return problem


def put(*path: str | int, value: Any) -> Callable[[Body], None]:
    def change(body: Body) -> None:
        target: Any = body
        for part in path[:-1]:
            target = target[part]
        target[path[-1]] = value

    return change


def vectors(row: list[float]) -> Callable[[Body], None]:
    """Directions as vectors, of which row 1 is the one given."""

    def change(body: Body) -> None:
        samples = body["samples"]
        for name in ("theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"):
            del samples[name]
        count = len(samples["values"])
        samples["wi"] = [[0.6, 0.0, 0.8] for _ in range(count)]
        samples["wo"] = [[-0.6, 0.0, 0.8] for _ in range(count)]
        samples["wi"][1] = row

    return change


BAD_FITS = {
    "unknown model": (put("model", value="lambert + ward_bouned"), "model", "Did you mean 'ward_bounded'?"),
    "unknown option": (put("model", value="ward(shiny)"), "model", "shiny"),
    "unknown parameter": (put("model", value="lambert(kx=0.1)"), "model", "Known: kd"),
    "unreadable model": (put("model", value="lambert(("), "model", "model"),
    "contradiction in the text": (put("model", value="ward(isotropic, anisotropic)"), "model", "isotropic and aniso"),
    "options against parameters": (put("model", value="ward(isotropic, ax=0.1)"), "model", "agree"),
    "parameter outside its box": (put("model", value="lambert(kd=1.5)"), "lambert.kd", "in [0, 1], got 1.5"),
    "fixed outside its box": (put("fixed", value={"lambert.kd": -0.1}), "lambert.kd", "in [0, 1], got -0.1"),
    "fixed by an unknown key": (put("fixed", value={"lambert.kx": 0.1}), "fixed", "Did you mean 'lambert.kd'?"),
    "gray by an unknown key": (put("gray", value=["lambert.kx"]), "gray", "lambert.kx"),
    "per_channel by an unknown key": (put("per_channel", value=["lambert.kx"]), "per_channel", "lambert.kx"),
    "unknown loss": (put("loss", value="cosin"), "loss", "Did you mean 'cosine'?"),
    "unknown optimizer": (put("optimizer", value="adamm"), "optimizer", "Did you mean 'adam'?"),
    "unknown quantity": (put("samples", "quantity", value="radiance"), "samples.quantity", "brdf_cos"),
    "undeclared quantity": (lambda body: body["samples"].pop("quantity"), "samples.quantity", "got nothing"),
    "unknown dataset": (lambda b: (b.pop("samples"), b.update(dataset="f" * 64)), "dataset", "POST /v1/datasets"),
    "a path as dataset": (lambda b: (b.pop("samples"), b.update(dataset="../lock")), "dataset", "POST /v1/datasets"),
    "no data": (lambda body: body.pop("samples"), "body", "exactly one"),
    "two sources of data": (put("dataset", value="f" * 64), "body", "exactly one"),
    "no model": (lambda body: body.pop("model"), "body", "either model or models"),
    "an unknown field": (put("modle", value="lambert"), "modle", "Remove it"),
    "an unknown field of samples": (put("samples", "theta_i", value=[0.1]), "samples.theta_i", "Remove it"),
    "below the horizon": (put("samples", "theta_i_deg", 3, value=95.0), "samples.theta_i_deg", "theta_i"),
    "vector below the horizon": (vectors([0.6, 0.0, -0.8]), "samples.wi", "horizon"),
    "vector not unit": (vectors([0.6, 0.0, 0.9]), "samples.wi", "unit"),
    "vector of two": (vectors([0.6, 0.8]), "samples.wi[1]", "3 items"),
    "both geometries": (put("samples", "wi", value=[[0.0, 0.0, 1.0]]), "samples", "Give one of the two"),
    "half a geometry": (lambda body: body["samples"].pop("phi_o_deg"), "samples", "in full"),
    "channels that do not fit": (put("samples", "channels", value=["r", "g", "b"]), "samples.channels", "1 name"),
    "rows of unequal length": (put("samples", "values", 2, value=[0.1, 0.2]), "samples", "row 2"),
    "rows without channels": (put("samples", "values", value=[[]] * 24), "samples", "row 0"),
    "no rows": (put("samples", "values", value=[]), "samples.values", "at least 1 item"),
    "fewer angles than values": (lambda b: b["samples"]["theta_i_deg"].pop(), "samples.theta_i_deg", "shape"),
    "sigma of zero": (put("samples", "sigma", value=[[0.0]] * 24), "samples.sigma", "positive"),
    "sigma of another shape": (put("samples", "sigma", value=[[0.1]] * 23), "samples.sigma", "shape"),
    "negative weight": (put("samples", "weight", value=[-1.0] * 24), "samples.weight", "weight"),
    "boolean for a number": (
        put("samples", "theta_i_deg", 0, value=True),
        "samples.theta_i_deg[0]",
        "number, got True",
    ),
    "text for a number": (put("samples", "values", 0, value=["0.1"]), "samples.values[0][0]", "number, got '0.1'"),
    "null for a number": (put("samples", "values", 0, value=[None]), "samples.values[0][0]", "number, got None"),
    "boolean to fix": (put("fixed", value={"lambert.kd": True}), "fixed.lambert.kd", "number, got True"),
    "text to fix, one a channel": (put("fixed", value={"lambert.kd": ["1"]}), "fixed.lambert.kd[0]", "number"),
    "wrong number of channels to fix": (put("fixed", value={"lambert.kd": [0.1, 0.2]}), "lambert.kd", "channels"),
    "seed with a fraction": (put("seed", value=1.5), "seed", "integer, got 1.5"),
    "negative seed": (put("seed", value=-1), "seed", "greater than or equal to 0"),
    "boolean seed": (put("seed", value=True), "seed", "integer, got True"),
    "huge seed": (put("seed", value=10**40), "seed", "seed"),
    "list for a text": (put("model", value=["lambert"]), "model", "string"),
    "empty model": (put("model", value=""), "model", "at least 1 character"),
    "long model": (put("model", value="lambert + " * 300), "model", "at most 2000 characters"),
}


@pytest.mark.parametrize("case", BAD_FITS)
def test_a_bad_fit_is_refused_at_once(http: TestClient, request_body: Body, case: str) -> None:
    change, field, words = BAD_FITS[case]
    change(request_body)
    problem = problem_of(http.post("/v1/fits", json=request_body), 422)
    assert problem["field"] == field
    assert words in problem["detail"]
    assert http.get("/v1/fits").json()["items"] == []


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "1" + "0" * 400])
def test_numbers_that_are_not_finite_are_refused(http: TestClient, request_body: Body, number: str) -> None:
    for path in (("samples", "values", 5, 0), ("samples", "theta_o_deg", 5), ("fixed", "lambert.kd")):
        body = copy.deepcopy(request_body) | {"fixed": {}}
        put(*path, value="HERE")(body)
        text = json.dumps(body).replace('"HERE"', number)
        problem = problem_of(http.post("/v1/fits", content=text, headers={"content-type": "application/json"}), 422)
        assert problem["field"].startswith(".".join(path[:2]))
        assert "finite" in problem["detail"]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b"", "valid JSON"),
        (b"{", "valid JSON"),
        (b"\xff\xfe", "valid JSON"),
        (b'{"model": "\xff"}', "valid JSON"),
        (b'{"model": "\\ud800", "dataset": "x"}', "valid JSON"),
        (b"[" * 100_000, "valid JSON"),
        (b"[]", "object"),
        (b"null", "object"),
        (b'"lambert"', "object"),
    ],
)
def test_a_body_that_is_no_request_is_refused(http: TestClient, body: bytes, words: str) -> None:
    problem = problem_of(http.post("/v1/fits", content=body, headers={"content-type": "application/json"}), 422)
    assert problem["field"] == "body"
    assert words in problem["detail"]


def test_every_field_at_fault_is_named_once(http: TestClient, request_body: Body) -> None:
    request_body |= {"seed": "1", "loss": 3, "extra": 0}
    request_body["samples"]["values"] = [[math.pi, "x"]] * 24
    problem = problem_of(http.post("/v1/fits", json=request_body), 422)
    fields = [error["field"] for error in problem["errors"]]
    assert fields == ["loss", "seed", "samples.values[0][1]", "extra"]
    assert problem["detail"] == problem["errors"][0]["message"]


def test_more_rows_than_go_inline_are_refused(http: TestClient, settings: Settings) -> None:
    body = {"samples": measured_diffuser(settings.inline_rows + 1), "model": "lambert"}
    problem = problem_of(http.post("/v1/fits", json=body), 413)
    assert problem["field"] == "samples"
    assert "POST /v1/datasets" in problem["detail"]


def npz_named(channel: str) -> bytes:
    up, out = [[0.0, 0.0, 1.0]], io.BytesIO()
    np.savez(out, wi=up, wo=up, values=[0.1], channels=[channel])
    return out.getvalue()


def truncated_merl() -> bytes:
    return struct.pack("<3i", 90, 90, 180) + bytes(8 * 1000)


BAD_FILES = {
    "empty": (b"", {}, "body", "empty"),
    "truncated MERL": (truncated_merl(), {"quantity": "brdf"}, "body", "bytes"),
    "unknown format": (b"\x00\x01\x02\x03", {}, "format", "known format"),
    "undeclared quantity": (csv_file(), {}, "quantity", "quantity"),
    "undeclared angle unit": (
        csv_file().replace(b"_deg", b""),
        {"quantity": "brdf"},
        "angle_unit",
        "angle_unit",
    ),
    "another format than declared": (csv_file(), {"format": "merl", "quantity": "brdf"}, None, "MERL"),
    "unknown format name": (csv_file(), {"format": "mrl"}, "format", "Did you mean 'merl'?"),
    "unknown quantity name": (csv_file(), {"quantity": "brfd"}, "quantity", "Did you mean 'brdf'?"),
    "unknown parameter": (csv_file(), {"quantty": "brdf"}, "quantty", "Remove it"),
    "half of a surrogate pair": (npz_named("\ud800"), {"quantity": "brdf"}, "channels", "can be printed"),
    "not a number": (csv_file().replace(b"0.12", b"nan", 1), {"quantity": "brdf"}, None, "line"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_file_is_refused_and_leaves_nothing(http: TestClient, settings: Settings, case: str) -> None:
    content, declared, field, words = BAD_FILES[case]
    problem = problem_of(http.post("/v1/datasets", content=content, params=declared), 422)
    assert field is None or problem["field"] == field
    assert words in problem["detail"]
    for folder in ("datasets", "incoming"):
        assert list((settings.data / folder).iterdir()) == []


def test_a_file_over_the_limit_is_refused_and_leaves_nothing(http: TestClient, settings: Settings) -> None:
    large = bytes(settings.upload_limit + 1)
    pieces = (large[at : at + 65536] for at in range(0, len(large), 65536))  # without a length told beforehand
    for content in (large, pieces):
        problem = problem_of(http.post("/v1/datasets", content=content), 413)
        assert str(settings.upload_limit) in problem["detail"]
    assert list((settings.data / "incoming").iterdir()) == []


def test_a_large_json_body_is_refused(http: TestClient) -> None:
    headers = {"content-type": "application/json"}
    problem_of(http.post("/v1/fits", content=b" " * (16 * 2**20 + 1), headers=headers), 413)


@pytest.mark.parametrize("kind", ["text/plain", "multipart/form-data; boundary=x", ""])
def test_fits_take_json_only(http: TestClient, kind: str) -> None:
    problem = problem_of(http.post("/v1/fits", content=b"{}", headers={"content-type": kind}), 415)
    assert "application/json" in problem["detail"]


def test_files_come_as_plain_bodies(http: TestClient) -> None:
    assert "--data-binary" in problem_of(http.post("/v1/datasets", files={"file": b"x"}), 415)["detail"]
    answer = http.post("/v1/datasets", content=b"x", headers={"content-encoding": "gzip"})
    assert "uncompressed" in problem_of(answer, 415)["detail"]


@pytest.mark.parametrize("path", ["/nothing", "/v1/fits/none", "/v1/datasets/none", "/v1/datasets/" + "f" * 64])
def test_what_does_not_exist_is_a_problem(http: TestClient, path: str) -> None:
    assert path.rpartition("/")[2] in problem_of(http.get(path), 404)["detail"]


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "/v1/fits/none/cancel"),
        ("DELETE", "/v1/fits/none"),
        ("GET", "/v1/fits/none/plots/lobes.svg"),
        ("GET", "/v1/fits/none/plots/lobes.gif"),
    ],
)
def test_a_fit_that_does_not_exist_is_a_problem(http: TestClient, method: str, path: str) -> None:
    problem_of(http.request(method, path), 404)


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [("PUT", "/v1/fits", "GET, POST"), ("PATCH", "/v1/fits/x", "DELETE, GET"), ("POST", "/healthz", "GET")],
)
def test_a_method_that_is_not_allowed_says_which_are(http: TestClient, method: str, path: str, allowed: str) -> None:
    answer = http.request(method, path)
    problem_of(answer, 405)
    assert answer.headers["allow"] == allowed


@pytest.mark.parametrize("accept", ["text/html", "application/json;q=0", "image/*, application/json; q=0.0"])
def test_what_cannot_be_accepted_is_a_problem(http: TestClient, accept: str) -> None:
    assert "application/json" in problem_of(http.get("/v1/fits", headers={"accept": accept}), 406)["detail"]


@pytest.mark.parametrize("accept", ["*/*", "application/*", "application/json", "text/html, */*;q=0.1"])
def test_what_can_be_accepted_is_answered(http: TestClient, accept: str) -> None:
    assert http.get("/v1/fits", headers={"accept": accept}).status_code == 200


@pytest.mark.parametrize(
    "query", [{"limit": "0"}, {"limit": "101"}, {"limit": "x"}, {"cursor": "x"}, {"cursor": "0"}, {"page": "2"}]
)
def test_bad_paging_is_a_problem(http: TestClient, query: dict[str, str]) -> None:
    (name,) = query
    assert problem_of(http.get("/v1/fits", params=query), 422)["field"] == name


def test_a_fault_of_the_service_is_a_problem_without_details(
    http: TestClient, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(self: Datasets, name: str) -> None:
        raise RuntimeError("secret")

    monkeypatch.setattr(Datasets, "get", broken)
    problem = problem_of(http.get("/v1/datasets/" + "f" * 64), 500)
    assert "secret" not in str(problem)
    assert "secret" in caplog.text


def test_a_problem_names_no_path_of_the_server(http: TestClient, tmp_path: pathlib.Path) -> None:
    answer = http.post("/v1/datasets", content=b"\x00", params={"format": "npz"})
    problem_of(answer, 422)
    assert str(tmp_path) not in answer.text
