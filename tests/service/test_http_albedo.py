"""Albedos over HTTP: values at once, tables as jobs, and a sentence for everything else."""

import io
import json
import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch
from service_cases import idling
from starlette.testclient import TestClient

import brdfcore as bc
from service.app import create_app
from service.schemas import CertificateView
from service.settings import Settings

TEXT = "lambert(kd=[0.5, 0.2]) + ward_bounded(isotropic, rs=0.3, a=0.2)"
VALUES = {"material": TEXT, "theta_deg": [0.0, 45.0, 85.0], "tolerance": 1e-4}
TABLE = {"material": "lambert(kd=0.5) + oren_nayar", "axes": {"oren_nayar.sigma": [0.1, 0.8], "lambert.kd": None}}


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    return Settings(data=tmp_path_factory.mktemp("service"), workers=1, inline_rows=100)


@pytest.fixture(scope="module")
def http(settings: Settings) -> Iterator[TestClient]:
    """One app for all, since none of these tests changes it for the others."""
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        yield client


@pytest.fixture(scope="module")
def idle(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A client of an app whose dispatcher never starts, so that tables stay queued."""
    with idling(Settings(data=tmp_path_factory.mktemp("idle"), workers=1)) as client:
        yield client


@pytest.fixture(scope="module")
def made(http: TestClient) -> dict[str, Any]:
    """A table that has been made."""
    return finished(http, TABLE)


def finished(http: TestClient, body: dict[str, Any]) -> dict[str, Any]:
    """A job that has succeeded."""
    answer = http.post("/v1/albedo", json=body, headers={"prefer": "wait=20"})
    assert answer.status_code == 200, answer.text
    assert answer.json()["status"] == "succeeded", answer.text
    return dict(answer.json())


@pytest.mark.parametrize("given", ["text", "json"])
def test_values_are_the_librarys(http: TestClient, given: str) -> None:
    material = bc.material(TEXT)
    answer = http.post("/v1/albedo", json=VALUES | ({} if given == "text" else {"material": material.to_json()}))
    assert answer.status_code == 200, answer.text
    found = answer.json()
    theta = torch.deg2rad(torch.tensor(VALUES["theta_deg"], dtype=torch.float64))
    with torch.no_grad():
        own = bc.albedo(material, theta, tolerance=1e-4)
    torch.testing.assert_close(torch.tensor(found["values"], dtype=torch.float64), own.values, rtol=1e-12, atol=0)
    assert [max(row) <= 1e-4 for row in found["error"]] == [True] * 3
    assert (found["met"], found["method"], found["evaluations"]) == (own.met, own.method, own.evaluations)
    assert (found["theta_deg"], found["phi_deg"], found["tolerance"]) == (VALUES["theta_deg"], 0.0, 1e-4)
    assert (found["material"], found["seconds"] > 0) == (str(material), True)


@pytest.mark.parametrize("text", [TEXT, "kurt_eq_13", "lafortune(ks=1, cx=-2, cy=-2, n=1000000)"])
def test_the_certificate_is_that_of_a_fit(http: TestClient, text: str) -> None:
    """The last one's claimed error is infinite, which JSON holds as null."""
    answer = http.post("/v1/albedo", json={"material": text, "theta_deg": [0.0], "tolerance": 0.1, "certificate": True})
    assert answer.status_code == 200, answer.text
    own = bc.certify(bc.material(text)).to_dict()
    assert answer.json()["certificate"] == own | {"seconds": answer.json()["certificate"]["seconds"]}
    assert CertificateView.model_validate(own).verdict == own["verdict"]
    assert http.post("/v1/albedo", json=VALUES).json().get("certificate") is None


def test_the_azimuth_counts(http: TestClient) -> None:
    body = {"material": "ward_bounded(rs=1, ax=0.1, ay=0.5)", "theta_deg": [85.0], "tolerance": 1e-3}
    along, across = (http.post("/v1/albedo", json=body | {"phi_deg": phi}).json()["values"] for phi in (0.0, 90.0))
    assert abs(along[0][0] - across[0][0]) > 0.01


def test_a_table_is_accepted_and_made(http: TestClient) -> None:
    answer = http.post("/v1/albedo", json=TABLE)
    assert (answer.status_code, answer.headers["retry-after"]) == (202, "1")
    accepted = answer.json()
    assert answer.headers["location"] == f"/v1/albedo/{accepted['id']}"
    assert (accepted["status"], accepted["result"]) == ("queued", None)
    assert accepted["request"] == {
        "material": str(bc.material(TABLE["material"])),
        "axes": TABLE["axes"],
        "tolerance": 1e-4,
    }
    end = time.monotonic() + 20
    while (table := http.get(f"/v1/albedo/{accepted['id']}").json())["status"] in ("queued", "running"):
        assert time.monotonic() < end
        time.sleep(0.02)
    assert (table["status"], table["error"], table["attempts"]) == ("succeeded", None, 1)
    assert table["progress"] == {"stage": "table", "fraction": 1.0, "loss": None}


def test_the_numbers_come_as_json_and_as_npz(
    http: TestClient, made: dict[str, Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    own = bc.albedo_table(TABLE["material"], {"oren_nayar.sigma": (0.1, 0.8), "lambert.kd": None}, cache=None)
    result = made["result"]
    assert (result["hash"], result["met"], result["channels"]) == (own.hash, True, 1)
    assert result["axes"][0]["name"] == "theta_deg"
    assert result["axes"][0]["high"] == 90.0
    assert [axis["nodes"] for axis in result["axes"]] == list(own.values.shape[:-1])
    path = f"/v1/albedo/{made['id']}/table"
    as_json = http.get(path)
    assert as_json.headers["content-type"] == "application/json"
    torch.testing.assert_close(bc.AlbedoTable.from_dict(as_json.json()).values, own.values, rtol=1e-12, atol=0)
    for accept in ("application/x-npz", "application/octet-stream", "application/json;q=0.5, application/x-npz"):
        as_npz = http.get(path, headers={"accept": accept})
        assert as_npz.headers["content-type"] in accept
        with np.load(io.BytesIO(as_npz.content)) as archive:
            np.testing.assert_allclose(archive["values"], own.values.numpy(), rtol=1e-12)
    file = tmp_path_factory.mktemp("downloads") / "table.npz"
    file.write_bytes(as_npz.content)
    assert float(bc.AlbedoTable.load(file)(0.3, **{"oren_nayar.sigma": 0.5, "lambert.kd": 0.1})) > 0
    assert http.get(path, headers={"accept": "text/csv"}).status_code == 406
    tag = http.get(path, headers={"accept": "application/x-npz"}).headers["etag"]
    assert http.get(path, headers={"accept": "application/x-npz", "if-none-match": tag}).status_code == 304
    assert http.get(path, headers={"if-none-match": tag}).status_code == 200, "as JSON it is another file"


def test_the_same_table_is_not_made_twice(http: TestClient, settings: Settings) -> None:
    first, again = (finished(http, TABLE | {"tolerance": 0.01}) for _ in range(2))
    assert again["id"] != first["id"]
    assert again["result"] == first["result"], "its seconds and evaluations are those of the first"
    kept = settings.data / "tables" / f"{first['result']['hash']}.npz"
    assert http.delete(f"/v1/albedo/{first['id']}").status_code == 204
    assert http.get(f"/v1/albedo/{again['id']}/table").status_code == 200, "another job still has it"
    assert kept.exists()
    assert http.delete(f"/v1/albedo/{again['id']}").status_code == 204
    assert not kept.exists()
    assert http.get(f"/v1/albedo/{again['id']}").status_code == 404


def test_numbers_that_are_gone_are_a_problem(http: TestClient, settings: Settings) -> None:
    table = finished(http, TABLE | {"tolerance": 0.02})
    (settings.data / "tables" / f"{table['result']['hash']}.npz").unlink()
    problem = http.get(f"/v1/albedo/{table['id']}/table").json()
    assert problem["status"] == 404
    assert "Post its request again" in problem["detail"]


def test_a_table_that_cannot_be_made_says_why(http: TestClient) -> None:
    material = "lafortune(ks=1, cx=-2, cy=-2, n=1000000)"  # no number holds its albedo
    body = {"material": material, "axes": {"theta_deg": [0, 86]}, "tolerance": 0.01}
    failed = http.post("/v1/albedo", json=body, headers={"prefer": "wait=20"}).json()
    assert (failed["status"], failed["result"]) == ("failed", None)
    assert failed["error"].startswith("Expected the albedo to be a finite number all over the table")


def test_a_table_without_a_limit_is_not_accepted(idle: TestClient) -> None:
    problem = idle.post("/v1/albedo", json={"material": "ward(isotropic, rs=1)", "axes": {}}).json()
    assert problem["status"] == 422
    assert problem["detail"].startswith("Expected the axis theta to end before the horizon for ward(isotropic)")


def test_fits_and_tables_are_apart(idle: TestClient, request_body: dict[str, Any]) -> None:
    fit = idle.post("/v1/fits", json=request_body).json()["id"]
    table = idle.post("/v1/albedo", json=TABLE).json()["id"]
    for own, path, other in ((fit, "/v1/fits", table), (table, "/v1/albedo", fit)):
        assert [item["id"] for item in idle.get(path).json()["items"]] == [own]
        for method, tail in (("GET", ""), ("POST", "/cancel"), ("DELETE", "")):
            answer = idle.request(method, f"{path}/{other}{tail}")
            assert answer.status_code == 404
            assert f"GET {path} lists them" in answer.json()["detail"]
    assert idle.get(f"/v1/fits/{table}/plots/albedo.svg").status_code == 404
    assert idle.get(f"/v1/albedo/{table}/table").status_code == 409
    assert idle.post(f"/v1/albedo/{table}/cancel").json()["status"] == "cancelled"
    assert idle.get(f"/v1/fits/{fit}").json()["status"] == "queued"
    assert idle.delete(f"/v1/albedo/{table}").status_code == 204
    assert idle.delete(f"/v1/fits/{fit}").status_code == 204


BAD: dict[str, tuple[dict[str, Any], str, str]] = {
    "no material": ({"material": None}, "material", "string"),
    "an unknown model": ({"material": "lambet"}, "material", "Did you mean 'lambert'?"),
    "outside its box": ({"material": "lambert(kd=2)"}, "lambert.kd", "in [0, 1], got 2"),
    "neither values nor table": ({"theta_deg": None}, "body", "exactly one"),
    "values and a table": ({"axes": {}}, "body", "exactly one"),
    "no angles": ({"theta_deg": []}, "theta_deg", "theta_deg to have at least 1 item, got 0. Correct"),
    "the horizon": ({"theta_deg": [0.0, 90.0]}, "theta_deg[1]", "less than 90, got 90"),
    "below the normal": ({"theta_deg": [-1.0]}, "theta_deg[0]", "greater than or equal to 0"),
    "text for a number": ({"theta_deg": ["30"]}, "theta_deg[0]", "number, got '30'"),
    "a boolean azimuth": ({"phi_deg": True}, "phi_deg", "number, got True"),
    "a tolerance of 0": ({"tolerance": 0.0}, "tolerance", "greater than or equal to"),
    "a loose tolerance": ({"tolerance": 0.5}, "tolerance", "less than or equal to 0.1"),
    "too many angles": ({"theta_deg": [1.0] * 501}, "theta_deg", "at most 1000 angles times terms"),
    "too many for the tolerance": ({"theta_deg": [1.0] * 51, "tolerance": 1e-9}, "theta_deg", "at most 100 angles"),
    "too many terms to certify": (
        {"material": " + ".join(["lambert(kd=0)"] * 21), "certificate": True},
        "theta_deg",
        "at most 1000 angles times terms",
    ),
    "too many channels": ({"material": f"lambert(kd={[0.1] * 65})"}, "theta_deg", "64 channels"),
    "an unknown field": ({"theta": [1.0]}, "theta", "Remove it"),
}
BAD_AXES: dict[str, tuple[dict[str, Any], str, str]] = {
    "an unknown axis": ({"axes": {"kurt.m": None}}, "axes", "a known name, got 'kurt.m'"),
    "an angle in radians": ({"axes": {"theta": [0.0, 1.5]}}, "axes", "named theta_deg"),
    "a range upside down": ({"axes": {"theta_deg": [60.0, 30.0]}}, "axes", "within [0, 90]"),
    "a range of the azimuth": ({"axes": {"phi_deg": [0.0, 90.0]}}, "axes", "Leave it out"),
    "a range outside the box": ({"axes": {"lambert.kd": [0.0, 2.0]}}, "axes", "within [0, 1]"),
    "a range of one number": ({"axes": {"lambert.kd": [0.5]}}, "axes.lambert.kd", "at least 2 items"),
    "a number as range": ({"axes": {"lambert.kd": 0.5}}, "axes.lambert.kd", "array, got 0.5"),
    "a certificate of a table": ({"certificate": True}, "body", "Expected certificate to go with theta_deg"),
    "axes without names": ({"axes": ["lambert.kd"]}, "axes", "an object"),
}


@pytest.mark.parametrize("case", [*BAD, *BAD_AXES])
def test_bad_input_is_a_problem(idle: TestClient, case: str) -> None:
    change, field, words = (BAD | BAD_AXES)[case]
    answer = idle.post("/v1/albedo", json=(VALUES if case in BAD else TABLE) | change)
    assert (answer.status_code, answer.headers["content-type"]) == (422, "application/problem+json"), answer.text
    problem = answer.json()
    assert problem["field"] == field
    assert words in problem["detail"]
    assert idle.get("/v1/albedo").json() == {"items": [], "next": None}, "nothing was accepted"


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999"])
def test_numbers_that_are_not_finite_are_refused(idle: TestClient, number: str) -> None:
    for name in ("theta_deg", "phi_deg", "tolerance"):
        text = json.dumps(VALUES | {name: "HERE"}).replace('"HERE"', f"[{number}]" if name == "theta_deg" else number)
        answer = idle.post("/v1/albedo", content=text, headers={"content-type": "application/json"})
        assert (answer.status_code, answer.json()["field"].partition("[")[0]) == (422, name)


def test_it_takes_json_only(idle: TestClient) -> None:
    assert idle.post("/v1/albedo", content=b"{}", headers={"content-type": "text/plain"}).status_code == 415
    assert idle.post("/v1/albedo", json=VALUES, headers={"accept": "text/csv"}).status_code == 406


def test_what_no_number_holds_is_null(http: TestClient) -> None:
    """A peak that overflows within the hemisphere has an albedo that no number holds."""
    body = {"material": "lafortune(ks=1, cx=-2, cy=-2, n=1000000)", "theta_deg": [80.0], "tolerance": 0.1}
    answer = http.post("/v1/albedo", json=body)
    assert answer.status_code == 200
    assert not any(word in answer.text for word in ("NaN", "Infinity"))
    assert all(x is None or math.isfinite(x) for x in answer.json()["values"][0])


def test_a_fits_albedo_is_drawn(http: TestClient, request_body: dict[str, Any]) -> None:
    fit = http.post("/v1/fits", json=request_body, headers={"prefer": "wait=20"}).json()
    path = f"/v1/fits/{fit['id']}/plots/albedo"
    svg, png = http.get(f"{path}.svg"), http.get(f"{path}.png", params={"phi_deg": "30", "channel": "value"})
    assert b"<svg" in svg.content
    assert png.content.startswith(b"\x89PNG")
    known = http.get(f"{path}.svg", headers={"if-none-match": svg.headers["etag"]})
    assert (known.status_code, known.content) == (304, b"")
    lobes = http.get(f"/v1/fits/{fit['id']}/plots/lobes.svg")
    assert lobes.headers["etag"] != svg.headers["etag"]
    for query, field in (({"channel": "x"}, "channel"), ({"phi_deg": "x"}, "phi_deg"), ({"scale": "log"}, "scale")):
        answer = http.get(f"{path}.svg", params=query)
        assert (answer.status_code, answer.json()["field"]) == (422, field)
