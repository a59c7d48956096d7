"""Fits over HTTP: submitted, waited for, listed, cancelled, removed, plotted."""

import json
import math
import time
from typing import Any

import pytest
from service_cases import KD, csv_file, measured_diffuser
from starlette.testclient import TestClient

import brdfcore as bc
from brdfcore.fitting.result import STATUSES
from service.schemas import FitOutcome

Body = dict[str, Any]


def finished(http: TestClient, fit_id: str) -> dict[str, Any]:
    """The fit once it has ended."""
    end = time.monotonic() + 20
    while (fit := http.get(f"/v1/fits/{fit_id}").json())["status"] in ("queued", "running"):
        assert time.monotonic() < end
        time.sleep(0.02)
    return dict(fit)


@pytest.fixture
def fit(http: TestClient, request_body: Body) -> dict[str, Any]:
    """A fit that has succeeded."""
    answer = http.post("/v1/fits", json=request_body, headers={"prefer": "wait=20"})
    assert answer.status_code == 200, answer.text
    assert answer.json()["status"] == "succeeded", answer.text
    return dict(answer.json())


def test_a_fit_is_accepted_and_ends(http: TestClient, request_body: Body) -> None:
    answer = http.post("/v1/fits", json=request_body)
    assert answer.status_code == 202
    assert answer.headers["retry-after"] == "1"
    accepted = answer.json()
    assert answer.headers["location"] == f"/v1/fits/{accepted['id']}"
    assert accepted["status"] == "queued"
    assert accepted["result"] is None
    fit = finished(http, accepted["id"])
    assert (fit["status"], fit["error"], fit["attempts"]) == ("succeeded", None, 1)
    assert fit["created"] <= fit["started"] <= fit["finished"]
    assert fit["progress"]["fraction"] == 1.0


def test_the_result_is_the_library_s_own(fit: dict[str, Any]) -> None:
    samples = measured_diffuser()
    columns = [samples[name] for name in ("theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", "values")]
    own = json.loads(json.dumps(bc.fit(bc.Samples.from_angles(*columns, unit="degrees"), "lambert").to_dict()))
    for result in (own, fit["result"]):
        del result["cost"]["seconds"], result["certificate"]["seconds"], result["report"]
    assert fit["result"] == own
    assert math.isclose(fit["result"]["parameters"]["lambert.kd"], KD, rel_tol=0.01)


def test_the_request_is_shown_without_its_samples(fit: dict[str, Any]) -> None:
    samples = fit["request"].pop("samples")
    assert samples["count"] == 24
    assert samples["hash"] == fit["result"]["provenance"]["input"]
    assert fit["request"] == {
        "dataset": None,
        "model": "lambert",
        "models": None,
        "loss": "cosine",
        "optimizer": "auto",
        "fixed": {},
        "gray": [],
        "per_channel": [],
        "seed": 0,
        "bounds": {},
        "starts": [],
        "robust": None,
        "robust_scale": None,
        "max_theta_deg": None,
        "conserve_energy": False,
    }


def test_several_models_are_one_job_whose_result_compares_them(http: TestClient, request_body: Body) -> None:
    del request_body["model"]
    models = ["lambert + ward(isotropic)", "lambert"]
    body = request_body | {"models": models, "fixed": {"ward.a": 0.2}, "seed": 3}
    fit = http.post("/v1/fits", json=body, headers={"prefer": "wait=20"}).json()
    assert fit["status"] == "succeeded", fit
    assert fit["request"]["models"] == models
    assert fit["request"]["model"] is None
    ranking = fit["result"]["comparison"]["ranking"]
    assert sorted(row["model"] for row in ranking) == sorted(models)
    assert [row["rank"] for row in ranking] == [1, 2]
    assert ranking[0]["objective"] <= ranking[1]["objective"]
    assert ranking[0]["fit"]["parameters"] == fit["result"]["parameters"]
    assert http.get(f"/v1/fits/{fit['id']}/plots/lobes.svg").status_code == 200
    refused = http.post("/v1/fits", json=body | {"models": ["lambert", "lambrt"]}).json()
    assert "Did you mean 'lambert'" in refused["detail"]
    for wrong in ({"model": "lambert"}, {"models": None}):
        assert "either model or models" in http.post("/v1/fits", json=body | wrong).json()["detail"]


def test_auto_shows_its_ladder(http: TestClient, request_body: Body) -> None:
    fit = http.post("/v1/fits", json=request_body | {"model": "auto"}, headers={"prefer": "wait=20"}).json()
    assert fit["status"] == "succeeded", fit
    assert [rung["effect"] for rung in fit["result"]["ladder"]][:2] == ["diffuse", "lobe"]


def test_vectors_and_angles_are_the_same_samples(http: TestClient, request_body: Body, fit: dict[str, Any]) -> None:
    angles = request_body["samples"]
    rad = {name: [math.radians(x) for x in angles[name]] for name in angles if name.endswith("_deg")}
    kept = {name: value for name, value in angles.items() if not name.endswith("_deg")}
    for side in ("i", "o"):
        pairs = zip(rad[f"theta_{side}_deg"], rad[f"phi_{side}_deg"], strict=True)
        kept[f"w{side}"] = [[math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)] for t, p in pairs]
    answer = http.post("/v1/fits", json={"samples": kept, "model": "lambert"}, headers={"prefer": "wait=20"})
    value = answer.json()["result"]["parameters"]["lambert.kd"]
    assert math.isclose(value, fit["result"]["parameters"]["lambert.kd"], rel_tol=1e-12)


def test_every_argument_reaches_the_fit(http: TestClient) -> None:
    samples = measured_diffuser(channels=2)
    samples |= {"channels": ["a", "b"], "sigma": [[0.01, 0.02]] * 24, "weight": [1.0] * 24, "cell": [0.5] * 24}
    body = {
        "samples": samples | {"azimuth_observed": False},
        "model": "lambert + ward_bounded",
        "loss": "l2",
        "optimizer": "lbfgs",
        "fixed": {"ward_bounded.rs": [0.0, 0.0], "ward_bounded.a": 0.2},
        "seed": 7,
    }
    gray = http.post("/v1/fits", json=body | {"gray": ["lambert.kd"]}, headers={"prefer": "wait=20"}).json()
    assert gray["status"] == "succeeded", gray
    result = gray["result"]
    assert (result["loss"], result["cost"]["optimizer"], result["channels"]) == ("l2", "lbfgs", ["a", "b"])
    assert result["provenance"]["seed"] == 7
    assert result["parameters"]["ward_bounded.rs"] == [0.0, 0.0]
    assert result["parameters"]["ward_bounded.a"] == 0.2
    assert isinstance(result["parameters"]["lambert.kd"], float)
    coloured = http.post("/v1/fits", json=body, headers={"prefer": "wait=20"}).json()
    assert len(coloured["result"]["parameters"]["lambert.kd"]) == 2
    for name in ("optimizer", "seed", "fixed"):
        del body[name]
    narrow = {
        "bounds": {"ward_bounded.rs": [0.1, 0.2]},
        "starts": [{"ward_bounded.rs": [0.1, 0.15], "ward_bounded.a": 0.3}],
        "robust": "soft_l1",
        "robust_scale": 0.5,
        "max_theta_deg": 60,
        "conserve_energy": True,
    }
    made = http.post("/v1/fits", json=body | narrow, headers={"prefer": "wait=20"}).json()
    assert made["request"]["max_theta_deg"] == 60
    result = made["result"]
    asked = {name: value for name, value in result["options"].items() if name != "starts"}
    assert asked == {name: value for name, value in narrow.items() if name != "starts"} | {
        "max_theta_deg": pytest.approx(60)
    }
    assert result["options"]["starts"][0]["ward_bounded.a"] == 0.3
    rs = bc.Material.from_json(result["material"]).values()["ward_bounded.rs"]  # the data leave it free
    assert bool(((rs >= 0.1) & (rs <= 0.2)).all())
    assert "steeper than 60 degrees" in result["data"]["masked"][0]["reason"]
    assert result["conservation"]["directions"] == 0
    assert result["certificate"]["energy_conserving"]


def test_a_lobe_that_exceeds_1_is_kept_from_it_at_a_stated_cost(http: TestClient) -> None:
    """Values as of a diffuser that reflects 1.2 times what it receives."""
    samples = measured_diffuser()
    samples["values"] = [[1.2 / KD * value for value in row] for row in samples["values"]]
    body = {"samples": samples, "model": "lambert + ward_bounded", "fixed": {"ward_bounded.a": 1.0}}
    free, kept = (
        http.post("/v1/fits", json=body | {"conserve_energy": asked}, headers={"prefer": "wait=20"}).json()["result"]
        for asked in (False, True)
    )
    assert free["certificate"]["max_albedo"] > 1.001
    assert free["conservation"] is None
    assert kept["certificate"]["max_albedo"] <= 1 + 1e-6
    assert kept["conservation"]["free_objective"] == pytest.approx(free["objective"], rel=1e-9)
    assert "Conserving energy made the error" in kept["report"]


@pytest.mark.parametrize(
    ("change", "field", "part"),
    [
        ({"bounds": {"lambert.kd": [0.5, 0.1]}}, "bounds", "the lower one first"),
        ({"bounds": {"lambert.kd": [0.5]}}, "bounds.lambert.kd", "at least 2"),
        ({"starts": [{"lambert.k": 0.5}]}, "starts", "lambert.kd"),
        ({"robust": "huber"}, "robust", "soft_l1"),
        ({"robust_scale": 1.0}, "robust_scale", "come with a robust form"),
        ({"max_theta_deg": 91}, "max_theta_deg", "90"),
        ({"conserve_energy": "yes"}, "conserve_energy", "bool"),
    ],
)
def test_what_cannot_narrow_a_fit_is_refused(
    http: TestClient, request_body: Body, change: Body, field: str, part: str
) -> None:
    answer = http.post("/v1/fits", json=request_body | change)
    assert answer.status_code == 422
    assert answer.json()["field"] == field
    assert part in answer.json()["detail"]


def test_a_dataset_is_fitted_as_inline_samples_are(http: TestClient, fit: dict[str, Any]) -> None:
    dataset = http.post("/v1/datasets", content=csv_file(), params={"quantity": "brdf"}).json()
    body = {"dataset": dataset["id"], "model": "lambert"}
    other = http.post("/v1/fits", json=body, headers={"prefer": "wait=20"}).json()
    assert other["request"]["dataset"] == dataset["id"]
    assert other["request"]["samples"] is None
    assert other["result"]["parameters"] == fit["result"]["parameters"]
    assert other["result"]["data"]["format"] == "csv"


@pytest.mark.parametrize(
    ("prefer", "applied"),
    [
        ("wait=20", "wait=20"),
        ('wait="20"', "wait=20"),
        ("respond-async, wait = 100", "wait=60"),
        ("handling=strict; wait=3, wait=4", "wait=3"),
        ("wait=1000000000000", None),
        ("wait=-1", None),
        ("wait=soon", None),
        ("await=3", None),
    ],
)
def test_prefer_is_read_as_its_standard_says(
    http: TestClient, request_body: Body, prefer: str, applied: str | None
) -> None:
    answer = http.post("/v1/fits", json=request_body, headers={"prefer": prefer})
    assert answer.headers.get("preference-applied") == applied
    assert answer.status_code == (202 if applied is None else 200)
    assert (answer.json()["result"] is None) == (applied is None)


def test_a_wait_that_is_too_short_is_answered_as_accepted(idle: TestClient, request_body: Body) -> None:
    begun = time.monotonic()
    answer = idle.post("/v1/fits", json=request_body, headers={"prefer": "wait=1"})
    assert 0.9 < time.monotonic() - begun < 2.0
    assert (answer.status_code, answer.json()["status"]) == (202, "queued")
    assert answer.headers["retry-after"] == "1"


def test_a_wait_ends_when_the_server_does(idle: TestClient, request_body: Body) -> None:
    idle.app.state.ending = lambda: True  # type: ignore[attr-defined]
    answer = idle.post("/v1/fits", json=request_body, headers={"prefer": "wait=60"})
    assert answer.status_code == 202


def test_the_list_is_paged(idle: TestClient, request_body: Body) -> None:
    assert idle.get("/v1/fits").json() == {"items": [], "next": None}
    ids = [idle.post("/v1/fits", json=request_body).json()["id"] for _ in range(5)][::-1]
    seen, cursor, pages = [], None, 0
    while cursor is not None or pages == 0:
        page = idle.get("/v1/fits", params={"limit": "2"} | ({"cursor": cursor} if cursor else {})).json()
        seen += [fit["id"] for fit in page["items"]]
        assert all("result" not in fit for fit in page["items"])
        cursor, pages = page["next"], pages + 1
    assert (seen, pages) == (ids, 3)


def test_a_fit_that_fails_says_why(http: TestClient, request_body: Body, monkeypatch: pytest.MonkeyPatch) -> None:
    # what passes the check and is refused by the fit: here the check is made blind
    monkeypatch.setattr("service.routes.fits.check", lambda *arguments, **keywords: None)
    request_body["model"] = "lambert(kd=2)"
    fit = http.post("/v1/fits", json=request_body, headers={"prefer": "wait=20"}).json()
    assert (fit["status"], fit["result"], fit["attempts"]) == ("failed", None, 1)
    assert fit["error"].startswith("Expected lambert.kd to be in [0, 1], got 2.")
    problem = http.get(f"/v1/fits/{fit['id']}/plots/lobes.svg")
    assert problem.status_code == 409


def test_cancelling_and_removing(idle: TestClient, request_body: Body) -> None:
    path = idle.post("/v1/fits", json=request_body).headers["location"]
    for _ in range(2):
        answer = idle.post(f"{path}/cancel")
        assert (answer.status_code, answer.json()["status"]) == (200, "cancelled")
        assert answer.json()["finished"] is not None
    assert idle.get(f"{path}/plots/lobes.svg").status_code == 409
    answer = idle.delete(path)
    assert (answer.status_code, answer.content) == (204, b"")
    assert idle.get(path).status_code == 404
    assert idle.delete(path).status_code == 404


def test_a_finished_fit_cannot_be_cancelled(http: TestClient, fit: dict[str, Any]) -> None:
    answer = http.post(f"/v1/fits/{fit['id']}/cancel")
    assert answer.status_code == 409
    assert "succeeded" in answer.json()["detail"]


@pytest.mark.parametrize("plot", ["lobes", "residuals"])
def test_plots_are_drawn_as_svg_and_png(http: TestClient, fit: dict[str, Any], plot: str) -> None:
    path = f"/v1/fits/{fit['id']}/plots/{plot}"
    svg, png = http.get(f"{path}.svg"), http.get(f"{path}.png")
    assert svg.headers["content-type"].startswith("image/svg+xml")
    assert b"<svg" in svg.content
    assert png.headers["content-type"] == "image/png"
    assert png.content.startswith(b"\x89PNG")
    assert svg.headers["etag"] != png.headers["etag"]


def test_a_plot_that_is_known_is_not_sent_again(http: TestClient, fit: dict[str, Any]) -> None:
    path = f"/v1/fits/{fit['id']}/plots/lobes.svg"
    tag = http.get(path).headers["etag"]
    assert tag.startswith("W/")
    for known in (tag, f'"other", {tag.removeprefix("W/")}', "*"):
        answer = http.get(path, headers={"if-none-match": known})
        assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", tag)
    other = http.get(path, params={"scale": "log", "theta_i_deg": ["15", "45"]}, headers={"if-none-match": tag})
    assert other.status_code == 200
    assert other.headers["etag"] != tag


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"scale": "sqrt"}, "scale"),
        ({"theta_i_deg": "90"}, "theta_i_deg[0]"),
        ({"theta_i_deg": "nan"}, "theta_i_deg[0]"),
        ({"theta_i_deg": "x"}, "theta_i_deg[0]"),
        ({"theta_i_deg": ["1"] * 13}, "theta_i_deg"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_a_plot_that_cannot_be_drawn_is_a_problem(
    http: TestClient, fit: dict[str, Any], query: dict[str, Any], field: str
) -> None:
    answer = http.get(f"/v1/fits/{fit['id']}/plots/lobes.svg", params=query)
    assert (answer.status_code, answer.json()["field"]) == (422, field)


def test_residuals_of_a_channel_that_is_not_there_are_a_problem(http: TestClient, fit: dict[str, Any]) -> None:
    path = f"/v1/fits/{fit['id']}/plots/residuals.svg"
    assert b"incidence" in http.get(path, params={"channel": "value"}).content
    answer = http.get(path, params={"channel": "red"})
    assert (answer.status_code, answer.json()["field"]) == (422, "channel")


def test_what_the_data_leave_free_is_in_the_answer(http: TestClient) -> None:
    """The sample was never turned: a width across has no number, and the status is a word that clients know."""
    body = {"samples": measured_diffuser(), "model": "lambert + ward_bounded(anisotropic)"}
    result = http.post("/v1/fits", json=body, headers={"prefer": "wait=20"}).json()["result"]
    assert result["status"] == "undetermined"
    assert result["undetermined"] == ["ward_bounded.ay with ward_bounded.rs"]
    assert result["parameters"]["ward_bounded.ay"] is None
    assert set(result["combinations"][0]) == {"ward_bounded.ay", "ward_bounded.rs"}
    assert any("azimuth was not observed" in sentence for sentence in result["warnings"])
    assert len(result["covariance"]) == len(result["covariance_keys"])
    FitOutcome.model_validate(result)
    known = FitOutcome.model_json_schema()["properties"]["status"]["enum"]
    assert tuple(known) == STATUSES


def test_a_plot_must_be_acceptable(http: TestClient, fit: dict[str, Any]) -> None:
    path = f"/v1/fits/{fit['id']}/plots/lobes.png"
    assert http.get(path, headers={"accept": "image/svg+xml"}).status_code == 406
    assert http.get(path, headers={"accept": "image/*"}).status_code == 200


def test_a_fit_that_is_removed_while_it_is_drawn_is_gone(
    http: TestClient, fit: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.jobs.store.JobStore.body", lambda self, fit_id: None)
    assert http.get(f"/v1/fits/{fit['id']}/plots/lobes.svg").status_code == 404


def test_every_model_is_listed(http: TestClient) -> None:
    models = http.get("/v1/models").json()["items"]
    assert [model["name"] for model in models] == list(bc.MODELS)
    for model in models:
        assert model["good_for"] == bc.MODELS[model["name"]].good_for
        assert model["summary"]
        assert model["summary"] in model["text"]
        assert all({"name", "description", "low", "high"} <= set(parameter) for parameter in model["parameters"])


def test_signs_of_life(http: TestClient) -> None:
    assert http.get("/healthz").json() == {"status": "ok"}
    assert http.get("/readyz").json() == {"status": "ready"}
    assert http.get("/").json()["docs"] == "/docs"


def test_a_service_without_its_dispatcher_is_not_ready(idle: TestClient) -> None:
    answer = idle.get("/readyz")
    assert (answer.status_code, answer.json()["title"]) == (503, "Service Unavailable")


def test_openapi_has_every_route_and_its_errors(http: TestClient) -> None:
    paths = http.get("/openapi.json").json()["paths"]
    assert {path: sorted(operations) for path, operations in paths.items()} == {
        "/": ["get"],
        "/healthz": ["get"],
        "/metrics": ["get"],
        "/readyz": ["get"],
        "/v1/albedo": ["get", "post"],
        "/v1/albedo/{table_id}": ["delete", "get"],
        "/v1/albedo/{table_id}/cancel": ["post"],
        "/v1/albedo/{table_id}/events": ["get"],
        "/v1/albedo/{table_id}/table": ["get"],
        "/v1/batches": ["get", "post"],
        "/v1/batches/{batch_id}": ["delete", "get"],
        "/v1/batches/{batch_id}/cancel": ["post"],
        "/v1/batches/{batch_id}/table": ["get"],
        "/v1/datasets": ["post"],
        "/v1/datasets/{dataset_id}": ["get"],
        "/v1/datasets/{dataset_id}/samples": ["get"],
        "/v1/evaluate": ["post"],
        "/v1/fits": ["get", "post"],
        "/v1/fits/{fit_id}": ["delete", "get"],
        "/v1/fits/{fit_id}/cancel": ["post"],
        "/v1/fits/{fit_id}/events": ["get"],
        "/v1/fits/{fit_id}/export/{format}": ["get"],
        "/v1/fits/{fit_id}/plots/albedo.png": ["get"],
        "/v1/fits/{fit_id}/plots/albedo.svg": ["get"],
        "/v1/fits/{fit_id}/plots/lobes.png": ["get"],
        "/v1/fits/{fit_id}/plots/lobes.svg": ["get"],
        "/v1/fits/{fit_id}/plots/residuals.png": ["get"],
        "/v1/fits/{fit_id}/plots/residuals.svg": ["get"],
        "/v1/formats": ["get"],
        "/v1/models": ["get"],
        "/v1/renders": ["get", "post"],
        "/v1/renders/{render_id}": ["delete", "get"],
        "/v1/renders/{render_id}/cancel": ["post"],
        "/v1/renders/{render_id}/events": ["get"],
        "/v1/renders/{render_id}/image.exr": ["get"],
        "/v1/renders/{render_id}/image.npy": ["get"],
        "/v1/renders/{render_id}/image.png": ["get"],
        "/v1/sphere": ["post"],
    }
    submit = paths["/v1/fits"]["post"]
    assert "samples" in submit["requestBody"]["content"]["application/json"]["schema"]["properties"]
    for operations in paths.values():
        for operation in operations.values():
            for status, answer in operation["responses"].items():
                if status >= "400":
                    assert list(answer["content"]) == ["application/problem+json"], (operation["operationId"], status)
