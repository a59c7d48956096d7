"""Presets over HTTP: listed with the models, and named where a model's text is."""

import dataclasses
from typing import Any

from starlette.testclient import TestClient

import brdfcore as bc


def test_every_preset_is_listed(http: TestClient) -> None:
    presets = http.get("/v1/models").json()["presets"]
    assert presets == [dataclasses.asdict(preset) for preset in bc.PRESETS.values()]


def test_a_preset_names_what_is_fitted(http: TestClient, request_body: dict[str, Any]) -> None:
    answer = http.post("/v1/fits", json={**request_body, "model": "walter_figure_3"})
    assert answer.status_code == 202
    assert answer.json()["request"]["model"] == "walter_figure_3"


def test_a_preset_in_a_sum_is_refused_before_the_fit(http: TestClient, request_body: dict[str, Any]) -> None:
    answer = http.post("/v1/fits", json={**request_body, "model": "lambert + walter_figure_3"})
    assert (answer.status_code, answer.json()["field"]) == (422, "model")
    assert "Expected the preset walter_figure_3 to stand alone" in answer.json()["detail"]
