"""Fitted materials as other programs' files, over HTTP."""

from typing import Any

import pytest
from starlette.testclient import TestClient

import brdfcore as bc


@pytest.fixture
def fit(http: TestClient, request_body: dict[str, Any]) -> dict[str, Any]:
    """A fit that has succeeded."""
    answer = http.post("/v1/fits", json=request_body, headers={"prefer": "wait=20"})
    assert answer.json()["status"] == "succeeded", answer.text
    return dict(answer.json())


def test_every_form_is_the_librarys(http: TestClient, fit: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("brdfcore.formats.merl.SHAPE", (9, 6, 12))
    material = bc.Material.from_json(fit["result"]["material"])
    for name, exporter in bc.EXPORTS.items():
        answer = http.get(f"/v1/fits/{fit['id']}/export/{name}")
        made = bc.export(material, name)
        assert answer.status_code == 200
        assert answer.content == made.to_bytes()
        assert answer.headers["content-type"].startswith(exporter.media_type)
        assert float(answer.headers["x-brdf-difference"]) == made.difference
        assert answer.headers["x-brdf-holds"] == made.holds
        assert answer.headers["content-disposition"].endswith(f'{exporter.suffix}"')


def test_refusals(http: TestClient, fit: dict[str, Any], request_body: dict[str, Any]) -> None:
    path = f"/v1/fits/{fit['id']}/export"
    unknown = http.get(f"{path}/radianse")
    assert (unknown.status_code, unknown.json()["field"]) == (422, "format")
    assert "Did you mean 'radiance'?" in unknown.json()["detail"]
    assert http.get("/v1/fits/none/export/json").status_code == 404
    assert http.get(f"{path}/json", headers={"accept": "text/html"}).status_code == 406
    anisotropic = {**request_body, "model": "ward_bounded(anisotropic, ax=0.1, ay=0.5)", "fixed": FIXED}
    other = http.post("/v1/fits", json=anisotropic, headers={"prefer": "wait=20"}).json()
    refused = http.get(f"/v1/fits/{other['id']}/export/merl")
    assert refused.status_code == 422
    assert "isotropic for a MERL table" in refused.json()["detail"]


FIXED = {"ward_bounded.ax": 0.1, "ward_bounded.ay": 0.5}


def test_what_has_not_succeeded_has_no_export(idle: TestClient, request_body: dict[str, Any]) -> None:
    queued = idle.post("/v1/fits", json=request_body).json()
    answer = idle.get(f"/v1/fits/{queued['id']}/export/json")
    assert answer.status_code == 409
    assert "it is queued. Only then is there something to send" in answer.json()["detail"]


def test_of_compared_models_any_is_exported_and_drawn(http: TestClient, request_body: dict[str, Any]) -> None:
    body = {"samples": request_body["samples"], "models": ["lambert", "lambert + ward_bounded"]}
    fit = http.post("/v1/fits", json=body, headers={"prefer": "wait=30"}).json()
    path = f"/v1/fits/{fit['id']}"
    ranking = fit["result"]["comparison"]["ranking"]
    for one in ranking:
        found = http.get(f"{path}/export/json", params={"rank": one["rank"]}).json()
        assert {name: found[name] for name in one["fit"]["material"]} == one["fit"]["material"]
    drawn = [http.get(f"{path}/plots/albedo.png", params={"rank": rank}).content for rank in (1, 2)]
    assert drawn[0] == http.get(f"{path}/plots/albedo.png").content != drawn[1]
    for tail in ("export/json", "plots/lobes.svg"):
        refused = http.get(f"{path}/{tail}", params={"rank": 3})
        assert (refused.status_code, refused.json()["field"]) == (422, "rank")
        assert (
            "Expected rank to be at most 2, the number of models that were fitted, got 3." in refused.json()["detail"]
        )
