"""GET /v1/formats, and uploads of formats that the service only passes on to the library."""

from pathlib import Path

import pytest
from starlette.testclient import TestClient

import brdfcore as bc
from brdfcore.demo import DATA

ALTA = "#DIM 6 1\n#PARAM_IN CARTESIAN\n#PARAM_OUT INV_STERADIAN\n0 0 1 0 0 1 .5\n"
ASTM = "VARS theta_i,phi_i,theta_s,phi_s,bsdf\n10,0,20,180,.5\n"
NIST = "lambda,thetai,phi,thetar,phir,f_r11\n.5,-10,0,20,0,.5\n"
TABLE = "# by hand\n10 0 20 180 .5\n"
COLUMNS = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value"


def test_every_format_is_listed(http: TestClient) -> None:
    items = http.get("/v1/formats").json()["items"]
    assert [item["name"] for item in items] == list(bc.FORMATS)
    assert [item["description"] for item in items] == [found.description for found in bc.FORMATS.values()]
    assert [item["name"] for item in items if not item["uploads"]] == ["curet"]
    assert http.get("/v1/formats", headers={"accept": "text/html"}).status_code == 406


@pytest.mark.parametrize("name", [name for name, found in bc.FORMATS.items() if found.write is not None])
def test_what_convert_writes_can_be_uploaded(name: str, http: TestClient, tmp_path: Path) -> None:
    if name in ("parquet", "arrow"):
        pytest.importorskip("pyarrow")
    write = bc.FORMATS[name].write
    assert write is not None
    samples = bc.read(DATA)
    write(samples, tmp_path / "x")
    answer = http.post("/v1/datasets", content=(tmp_path / "x").read_bytes())
    assert answer.status_code == 201
    report = answer.json()["report"]
    assert (report["format"], report["samples"], report["has_sigma"]) == (name, 222, True)
    body = {"dataset": answer.json()["id"], "model": "lambert"}
    fit = http.post("/v1/fits", json=body, headers={"prefer": "wait=30"}).json()
    assert fit["status"] == "succeeded", fit["error"]
    assert fit["result"]["data"]["samples"] == 222


@pytest.mark.parametrize(
    ("content", "declared", "name"),
    [
        (ALTA, {}, "alta"),
        (ASTM, {"angle_unit": "degrees"}, "astm"),
        (NIST, {}, "nist"),
        (TABLE, {"columns": COLUMNS, "quantity": "brdf"}, "csv"),
    ],
)
def test_text_formats_can_be_uploaded(content: str, declared: dict[str, str], name: str, http: TestClient) -> None:
    answer = http.post("/v1/datasets", content=content.encode(), params=declared)
    assert answer.status_code == 201, answer.json()
    assert answer.json()["report"]["format"] == name
    fit = http.post("/v1/fits", json={"dataset": answer.json()["id"], "model": "lambert"}, headers={"prefer": "wait=0"})
    assert fit.status_code == 202


def test_a_spectrum_is_uploaded_as_red_green_and_blue(http: TestClient) -> None:
    names = [str(nm) for nm in range(400, 701, 20)]
    head = "# quantity: brdf\n" + ",".join(["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", *names])
    content = f"{head}\n10,0,20,180{',0.2' * 16}\n20,0,20,180{',0.1' * 16}\n".encode()
    spectral, rgb = (http.post("/v1/datasets", content=content, params=asked).json() for asked in ({}, {"rgb": True}))
    assert (spectral["report"]["channels"], "rgb" in spectral["declared"]) == (names, False)
    assert (rgb["report"]["channels"], rgb["declared"]["rgb"]) == (["r", "g", "b"], True)
    assert rgb["id"] != spectral["id"]
    assert http.get(f"/v1/datasets/{rgb['id']}/samples").json()["values"][0] == pytest.approx([0.2, 0.2, 0.2])
    again = http.post("/v1/datasets", content=content, params={"rgb": "false"})
    assert (again.status_code, again.json()["id"]) == (200, spectral["id"])
    body = {"dataset": rgb["id"], "model": "lambert"}
    fit = http.post("/v1/fits", json=body, headers={"prefer": "wait=30"}).json()
    assert len(fit["result"]["parameters"]["lambert.kd"]) == 3
    refused = http.post("/v1/datasets", content=NIST.encode(), params={"rgb": True})
    assert (refused.status_code, refused.json()["field"]) == (422, "rgb")
    assert "got 1 wavelength, 500 nm, 0.0% of what the eye sees." in refused.json()["detail"]


def test_half_of_two_files_is_refused_with_the_way_out(http: TestClient) -> None:
    row = "1 " + " ".join(["0.100"] * 205) + "\n"
    answer = http.post("/v1/datasets", content=row.encode())
    assert answer.status_code == 422
    assert "table.txt, which holds the directions, to lie beside data, got none" in answer.json()["detail"]
    assert "send what `brdf convert` makes of them" in answer.json()["detail"]


def test_damaged_uploads_are_refused(http: TestClient) -> None:
    for content in (b"PAR1" + bytes(100), b"ARROW1\0\0" + bytes(100), b"\x93NUMPY\x01\0v\0{", ALTA[:40].encode()):
        assert http.post("/v1/datasets", content=content).status_code == 422
