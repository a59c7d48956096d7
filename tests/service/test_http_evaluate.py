"""Evaluation over HTTP: the library's numbers, and a sentence for everything else."""

import json
import math
from collections.abc import Iterator
from typing import Any

import pytest
import torch
from starlette.testclient import TestClient

import brdfcore as bc
from brdfcore.energy._described import finite
from brdfcore.geometry import from_angles
from service.app import create_app
from service.settings import Settings

TEXT = "lambert(kd=[0.2, 0.1, 0.05]) + ward_bounded(rs=0.05, ax=0.1, ay=0.3)"
ANGLES = {
    "theta_i_deg": [10.0, 60.0, 89.0],
    "phi_i_deg": [0.0, 20.0, 90.0],
    "theta_o_deg": [10.0, 50.0, 80.0],
    "phi_o_deg": [180.0, 200.0, 0.0],
}


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    return Settings(data=tmp_path_factory.mktemp("service"), workers=1, inline_rows=100)


@pytest.fixture(scope="module")
def http(settings: Settings) -> Iterator[TestClient]:
    """One app for all, since none of these tests changes it for the others."""
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        yield client


def directions() -> tuple[torch.Tensor, torch.Tensor]:
    rad = {name: torch.deg2rad(torch.tensor(angle, dtype=torch.float64)) for name, angle in ANGLES.items()}
    return tuple(from_angles(rad[f"theta_{side}_deg"], rad[f"phi_{side}_deg"]) for side in "io")  # type: ignore[return-value]


@pytest.mark.parametrize("geometry", ["angles", "vectors"])
@pytest.mark.parametrize("given", ["text", "json"])
def test_the_numbers_are_the_librarys(http: TestClient, geometry: str, given: str) -> None:
    material, (wi, wo) = bc.material(TEXT), directions()
    body: dict[str, Any] = {"material": TEXT if given == "text" else material.to_json()}
    body |= ANGLES if geometry == "angles" else {"wi": wi.tolist(), "wo": wo.tolist()}
    answer = http.post("/v1/evaluate", json=body)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["material"] == str(material)
    for name in ("f", "pdf", "weight"):
        expected = getattr(material, name)(wi, wo).detach()
        torch.testing.assert_close(torch.tensor(found[name], dtype=torch.float64), expected, rtol=1e-12, atol=0)


def test_a_gray_material_has_one_column_and_a_preset_is_a_material(http: TestClient) -> None:
    found = http.post("/v1/evaluate", json={"material": "red_linoleum_ward_bounded"} | ANGLES).json()
    assert [len(row) for row in found["f"]] == [1, 1, 1]
    assert found["material"] == str(bc.material("red_linoleum_ward_bounded"))


def test_what_is_not_finite_is_null() -> None:
    numbers = torch.tensor([[1.0, math.nan], [math.inf, -2.0]], dtype=torch.float64)
    assert finite(numbers) == [[1.0, None], [None, -2.0]]
    assert finite(numbers[1]) == [None, -2.0]


BAD: dict[str, tuple[dict[str, Any], int, str, str]] = {
    "no material": ({"material": None}, 422, "material", "string"),
    "an unknown model": ({"material": "lambet"}, 422, "material", "Did you mean 'lambert'?"),
    "a preset in a sum": ({"material": "lambert + red_linoleum_ward"}, 422, "material", "stand alone"),
    "outside its box": ({"material": "lambert(kd=2)"}, 422, "lambert.kd", "in [0, 1], got 2"),
    "a JSON that is no material": ({"material": {"terms": []}}, 422, "material", "without 'values'"),
    "a number as material": ({"material": 3}, 422, "material", "string"),
    "no directions": (dict.fromkeys(ANGLES), 422, "body", "in full"),
    "both geometries": ({"wi": [[0.0, 0.0, 1.0]]}, 422, "body", "Give one of the two"),
    "no rows": ({name: [] for name in ANGLES}, 422, "theta_i_deg", "at least 1 item"),
    "below the horizon": ({"theta_o_deg": [10.0, 95.0, 80.0]}, 422, "theta_o_deg", "above the horizon"),
    "rows that do not fit": ({"phi_o_deg": [0.0, 1.0]}, 422, "phi_o_deg", "shape"),
    "text for a number": ({"phi_o_deg": ["0", 0.0, 0.0]}, 422, "phi_o_deg[0]", "number, got '0'"),
    "an unknown field": ({"theta": [1.0]}, 422, "theta", "Remove it"),
    "too many rows": ({name: [1.0] * 101 for name in ANGLES}, 413, "theta_i_deg", "at most 100 pairs"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_a_problem(http: TestClient, case: str) -> None:
    change, status, field, words = BAD[case]
    answer = http.post("/v1/evaluate", json={"material": TEXT} | ANGLES | change)
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json"), answer.text
    assert answer.json()["field"] == field
    assert words in answer.json()["detail"]


def test_vectors_that_are_not_unit_are_a_problem(http: TestClient) -> None:
    body = {"material": TEXT, "wi": [[0.0, 0.0, 1.1]], "wo": [[0.0, 0.0, 1.0]]}
    problem = http.post("/v1/evaluate", json=body).json()
    assert (problem["status"], problem["field"]) == (422, "wi")


def test_rows_times_channels_are_bounded(http: TestClient, settings: Settings) -> None:
    kd = [0.1] * 10_000
    material = bc.material("lambert").to_json() | {"values": {"lambert.kd": kd}}
    rows = {name: [1.0] * settings.inline_rows for name in ANGLES}
    problem = http.post("/v1/evaluate", json={"material": material} | rows).json()
    assert (problem["status"], problem["field"]) == (422, "material")
    assert "at most 1000000, got 100 times 10001" in problem["detail"]


@pytest.mark.parametrize("content", [b"", b"[]", b'{"material": NaN}', b'{"material": "lambert", "wi": [[NaN]]}'])
def test_a_body_that_is_no_request_is_a_problem(http: TestClient, content: bytes) -> None:
    answer = http.post("/v1/evaluate", content=content, headers={"content-type": "application/json"})
    assert (answer.status_code, answer.headers["content-type"]) == (422, "application/problem+json")


def test_it_takes_and_gives_json_only(http: TestClient) -> None:
    text = json.dumps({"material": TEXT} | ANGLES)
    assert http.post("/v1/evaluate", content=text, headers={"content-type": "text/plain"}).status_code == 415
    headers = {"content-type": "application/json", "accept": "text/csv"}
    assert http.post("/v1/evaluate", content=text, headers=headers).status_code == 406


def test_whole_numbers_in_a_materials_json_are_numbers(http: TestClient) -> None:
    given = bc.material("lambert(kd=1)").to_json()
    given["values"]["lambert.kd"] = 1  # as JavaScript writes 1.0
    answer = http.post("/v1/evaluate", json={"material": given} | ANGLES)
    assert answer.status_code == 200, answer.text
    assert answer.json()["f"] == [[pytest.approx(1 / math.pi)]] * 3
