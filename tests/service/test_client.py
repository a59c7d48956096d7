"""The client, against the app without sockets, and alone where the service misbehaves."""

import dataclasses
import io
import json
import math
import pathlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import httpx2
import numpy as np
import pytest
import torch
from service_cases import KD, csv_file, measured_diffuser
from starlette.testclient import TestClient

import brdfcore as bc
from service.client import (
    Client,
    ClientError,
    Declared,
    Directions,
    FitFailedError,
    FitOptions,
    FitResult,
    FitUnfinishedError,
    JobFailedError,
    JobUnfinishedError,
    ProblemError,
    UnreachableError,
    WaitError,
    persistence,
    waiting,
)
from service.client import data as sent
from service.routes.datasets import Declarations
from service.schemas import DirectionPairs, FitRequest


@pytest.fixture
def client(http: TestClient) -> Iterator[Client]:
    with Client("http://testserver", transport=http._transport) as client:
        yield client


def as_samples() -> bc.Samples:
    given = measured_diffuser()
    columns = [given[name] for name in ("theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", "values")]
    return bc.Samples.from_angles(*columns, unit="degrees")


def as_file(folder: pathlib.Path) -> pathlib.Path:
    path = folder / "diffuser.csv"
    path.write_bytes(csv_file())
    return path


def as_arrays() -> dict[str, Any]:
    given = measured_diffuser()
    arrays = {name: np.asarray(value) for name, value in given.items() if name != "quantity"}
    return arrays | {"values": arrays["values"][:, 0]}


@pytest.mark.parametrize("kind", ["Samples", "like Samples", "path", "str", "arrays", "dataset"])
def test_every_kind_of_data_gives_the_library_s_numbers(client: Client, tmp_path: pathlib.Path, kind: str) -> None:
    data = {
        "Samples": as_samples,
        "like Samples": lambda: SimpleNamespace(**{n: getattr(as_samples(), n) for n in ("wi", "wo", "values")}),
        "path": lambda: as_file(tmp_path),
        "str": lambda: str(as_file(tmp_path)),
        "arrays": as_arrays,
        "dataset": lambda: client.upload(as_file(tmp_path), quantity="brdf"),
    }[kind]()
    fit = client.fit(data, model="lambert", quantity="brdf")
    own = bc.fit(as_samples(), "lambert")
    assert fit.parameters["lambert.kd"] == pytest.approx(float(own.parameters["lambert.kd"]), rel=1e-12)
    assert fit.intervals["lambert.kd"] == pytest.approx(own.intervals["lambert.kd"].tolist(), rel=1e-9)
    assert fit.errors["cosine"] == pytest.approx(own.errors["cosine"], rel=1e-9)
    assert (fit.status, fit.job_status, fit.undetermined) == ("converged", "succeeded", [])
    assert fit.cost.optimizer == "least_squares"
    assert fit.result.model == "lambert"


def test_arguments_reach_the_service(client: Client) -> None:
    given = measured_diffuser(channels=2)
    fit = client.fit(
        given,
        model="lambert + ward_bounded",
        loss="l2",
        optimizer="lbfgs",
        fixed={"ward_bounded.rs": torch.zeros(2), "ward_bounded.a": np.float64(0.2)},  # type: ignore[dict-item]
        gray=("lambert.kd",),
        seed=3,
    )
    shown = fit.view.request
    assert (shown.loss, shown.optimizer, shown.gray, shown.seed) == ("l2", "lbfgs", ["lambert.kd"], 3)
    assert shown.fixed == {"ward_bounded.rs": [0.0, 0.0], "ward_bounded.a": 0.2}
    fit = client.fit(
        given,
        model="lambert + ward_bounded",
        bounds={"ward_bounded.a": (0.1, np.float64(0.2))},
        starts=[{"ward_bounded.rs": torch.zeros(2)}],  # type: ignore[dict-item]
        robust="cauchy",
        robust_scale=0.3,
        max_theta_deg=70,
        conserve_energy=True,
    )
    shown = fit.view.request
    assert (shown.bounds, shown.starts) == ({"ward_bounded.a": [0.1, 0.2]}, [{"ward_bounded.rs": [0.0, 0.0]}])
    assert (shown.robust, shown.robust_scale, shown.max_theta_deg) == ("cauchy", 0.3, 70)
    assert fit.certificate.energy_conserving
    assert fit.result.conservation is not None


def test_several_models_are_compared(client: Client) -> None:
    fit = client.fit(measured_diffuser(), models=["lambert + kurt", "lambert"])
    assert fit.comparison is not None
    ranking = fit.comparison.ranking
    assert ranking[0].fit.model == fit.result.model
    assert {ranked.status for ranked in ranking} == {"converged", "undetermined"}
    assert ranking[1].fit.model.encode() in fit.export("json", rank=2).content
    assert fit.plot("albedo", "png", rank=2) != fit.plot("albedo", "png")
    (one,) = client.fits([measured_diffuser()], models=["lambert"])
    assert one.parameters["lambert.kd"] == pytest.approx(KD, rel=0.01)
    with pytest.raises(ProblemError, match="Expected either model or models to be given"):
        client.fit(measured_diffuser(), model="lambert", models=["lambert"])
    assert client.fit(measured_diffuser(), model="lambert").comparison is None


def test_what_may_be_asked_is_what_the_service_takes() -> None:
    apart = {"dataset", "samples", "model", "models"}
    assert set(FitOptions.__annotations__) - set(Declared.__annotations__) == set(FitRequest.model_fields) - apart
    assert set(Declared.__annotations__) == set(Declarations.model_fields)
    assert set(Directions.__annotations__) == set(DirectionPairs.model_fields)


def test_the_report_and_the_plots_are_for_people(client: Client) -> None:
    fit = client.fit(as_samples(), model="lambert")
    assert fit.report().startswith("lambert\nconverged")
    assert all(b"<svg" in fit.plot(name) for name in ("lobes", "albedo", "residuals"))
    assert fit.plot("lobes", "png", scale="log", theta_i_deg=[20, 40]).startswith(b"\x89PNG")
    assert repr(fit) == f"FitResult({fit.id}, 'lambert', succeeded)"


def test_a_fit_is_exported(client: Client) -> None:
    fit = client.fit(as_samples(), model="lambert")
    made = fit.export("radiance")
    assert b"void WGMDfunc brdf" in made.content
    assert (made.difference, made.holds) == (0.0, "Radiance material WGMDfunc.")


def test_many_samples_travel_as_a_file(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sent, "INLINE_ROWS", 10)
    samples = as_samples()
    fit = client.fit(samples, model="lambert")
    assert fit.view.request.samples is None
    assert fit.result.data["format"] == "npz"
    assert fit.result.provenance["input"] == samples.hash
    arrays = client.fit(as_arrays(), model="lambert", quantity="brdf")
    assert arrays.parameters["lambert.kd"] == pytest.approx(fit.parameters["lambert.kd"], rel=1e-12)


def test_what_samples_say_of_their_azimuth_travels_with_them(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    samples = as_samples()
    turned = bc.Samples(samples.wi, samples.wo, samples.values, azimuth_observed=True)
    for rows in (100, 10):
        monkeypatch.setattr(sent, "INLINE_ROWS", rows)
        assert client.fit(turned, model="lambert").result.data["azimuth_observed"] is True


def test_a_fit_need_not_be_waited_for(client: Client) -> None:
    fit = client.fit(as_samples(), model="lambert", wait=False)
    if fit.view.result is None:
        with pytest.raises(FitUnfinishedError, match=r"Expected fit \w+ to have succeeded, but it is \w+\."):
            _ = fit.parameters
    assert fit.wait() is fit
    assert client.get(fit.id).parameters == fit.parameters
    fit.delete()
    with pytest.raises(ProblemError, match="Expected the id of a fit"):
        fit.refresh()


def test_formats_are_listed_and_a_table_is_named(client: Client, tmp_path: pathlib.Path) -> None:
    assert [found.name for found in client.formats()] == list(bc.FORMATS)
    path = tmp_path / "table.txt"
    path.write_text("10 0 20 180 .2\n20 0 20 180 .2\n")
    columns = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value"
    assert client.upload(path, quantity="brdf", columns=columns).report["samples"] == 2
    fit = client.fit(path, model="lambert", quantity="brdf", columns=columns)
    assert fit.parameters["lambert.kd"] == pytest.approx(0.2 * math.pi)


def test_a_spectrum_travels_as_a_file(client: Client, tmp_path: pathlib.Path) -> None:
    nm = [str(nm) for nm in range(400, 701, 30)]
    samples = as_samples()
    spectrum = bc.Samples(samples.wi, samples.wo, samples.values.expand(-1, len(nm)), nm)
    bc.FORMATS["npz"].write(spectrum, tmp_path / "spectrum.npz")  # type: ignore[misc]
    assert client.upload(tmp_path / "spectrum.npz", rgb=True).report["channels"] == ["r", "g", "b"]
    assert len(client.fit(tmp_path / "spectrum.npz", model="lambert", rgb=True).parameters["lambert.kd"]) == 3
    with pytest.raises(ClientError, match=r"rgb to go with a file, got samples\. Pass what their to_rgb\(\) returns"):
        client.fit(spectrum, model="lambert", rgb=True)


def test_models_are_listed(client: Client) -> None:
    assert [model.name for model in client.models()] == list(bc.MODELS)


def test_an_upload_is_described(client: Client, tmp_path: pathlib.Path) -> None:
    dataset = client.upload(as_file(tmp_path), format="csv", quantity="brdf")
    assert (dataset.report["samples"], dataset.declared["format"]) == (24, "csv")


def test_a_refusal_carries_its_sentence_and_field(client: Client) -> None:
    with pytest.raises(ProblemError, match="Did you mean 'lambert'") as refused:
        client.fit(as_samples(), model="lambet")
    assert (refused.value.status, refused.value.field, refused.value.errors) == (422, "model", [])
    with pytest.raises(ProblemError, match=r"samples.quantity to be given") as refused:
        client.fit(as_arrays(), model="lambert")
    assert [error.field for error in refused.value.errors] == ["samples.quantity"]
    with pytest.raises(ClientError, match="Expected data to hold values, got none"):
        client.fit({"wi": [[0.0, 0.0, 1.0]]}, model="lambert")


def test_an_unreadable_file_is_the_caller_s_error(client: Client, tmp_path: pathlib.Path) -> None:
    with pytest.raises(FileNotFoundError):
        client.fit(tmp_path / "nothing.csv", model="lambert")


def fit_view(status: str, **more: Any) -> dict[str, Any]:
    request = {"dataset": "x", "samples": None, "model": "lambert", "loss": "cosine", "optimizer": "auto"}
    request |= {"fixed": {}, "gray": [], "per_channel": [], "seed": 0}
    view = {"id": "f1", "status": status, "progress": None, "request": request, "error": None, "attempts": 1}
    return view | {"created": "2026-01-01T00:00:00Z", "started": None, "finished": None, "result": None} | more


def scripted(answer: Callable[[httpx2.Request], httpx2.Response], **more: Any) -> Client:
    return Client("http://nowhere", transport=httpx2.MockTransport(answer), **more)


def test_a_fit_that_failed_or_was_cancelled_is_an_exception() -> None:
    for view, words in (
        (fit_view("failed", error="Expected less."), "Expected less."),
        (fit_view("cancelled"), "The fit f1 was cancelled."),
    ):
        client = scripted(lambda request, view=view: httpx2.Response(200, json=view))
        with client, pytest.raises(FitFailedError, match=words):
            client.get("f1").wait()


def test_waiting_ends_with_its_time() -> None:
    client = scripted(lambda request: httpx2.Response(200, json=fit_view("running")))
    with client, pytest.raises(WaitError, match=r"Expected /v1/fits/f1 to be finished within ") as late:
        client.fit({"values": [1.0]}, model="lambert", timeout=0.1)
    assert isinstance(late.value, TimeoutError)


def test_cancelling_answers_with_the_cancelled_fit() -> None:
    def answer(request: httpx2.Request) -> httpx2.Response:
        return httpx2.Response(200, json=fit_view("cancelled" if request.method == "POST" else "running"))

    with scripted(answer) as client:
        fit = client.get("f1").cancel()
    assert isinstance(fit, FitResult)
    assert fit.job_status == "cancelled"


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pauses between the tries of a request that take no time."""
    monkeypatch.setattr(persistence, "_FIRST", 0.0)


def test_a_request_is_sent_again_where_the_service_is_busy_or_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    pauses: list[float] = []
    monkeypatch.setattr(waiting.time, "sleep", pauses.append)
    seen: list[httpx2.Request] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        seen.append(request)
        if len(seen) == 1:
            raise httpx2.ReadError("gone")
        if len(seen) < 4:
            return httpx2.Response((429, 503)[len(seen) - 2], headers={"retry-after": str(len(seen))})
        return httpx2.Response(202, json=fit_view("queued"))

    with scripted(answer) as client:
        client.fit({"values": [1.0], "quantity": "brdf"}, model="lambert", wait=False)
    assert len({request.headers["idempotency-key"] for request in seen}) == 1
    assert pauses == [0.0, 2.0, 3.0]
    seen.clear()
    problem = {"title": "Too Many Requests", "status": 429, "detail": "Expected fewer."}
    busy = httpx2.Response(429, json=problem, headers={"content-type": "application/problem+json"})
    with scripted(lambda request: busy) as client, pytest.raises(ProblemError, match="Expected fewer"):
        client.models()


def test_a_service_that_does_not_answer_is_named() -> None:
    def refuse(request: httpx2.Request) -> httpx2.Response:
        raise httpx2.ConnectError("refused")

    with scripted(refuse) as client, pytest.raises(UnreachableError, match=r"http://nowhere.*Is it running\?"):
        client.models()


def test_an_answer_of_another_service_is_told_apart() -> None:
    client = scripted(lambda request: httpx2.Response(502, text="<html>"))
    foreign = scripted(lambda request: httpx2.Response(200, text="<p>It works!</p>"))
    with foreign, pytest.raises(UnreachableError, match=r"Expected an answer of this service at http.*/v1/models, got"):
        foreign.models()
    with client, pytest.raises(ProblemError, match=r"got status 502. Check the URL.") as refused:
        client.models()
    assert refused.value.status == 502


def test_the_key_and_the_wait_are_sent() -> None:
    seen: list[httpx2.Request] = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        seen.append(request)
        return httpx2.Response(202, json=fit_view("queued"))

    with scripted(answer, api_key="secret") as client:
        client.fit({"values": [1.0], "quantity": "brdf"}, model="lambert", wait=False)
    assert seen[0].headers["authorization"] == "Bearer secret"
    assert seen[0].headers["prefer"] == "wait=0"
    assert json.loads(seen[0].content)["samples"] == {"values": [[1.0]], "quantity": "brdf"}


class Counting(httpx2.BaseTransport):
    """A service that takes any upload and counts the pieces in which it comes."""

    def __init__(self) -> None:
        self.pieces: list[int] = []

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        assert isinstance(request.stream, httpx2.SyncByteStream)
        self.pieces = [len(piece) for piece in request.stream]
        assert request.headers["content-length"] == str(sum(self.pieces))
        dataset = {"id": "d", "bytes": sum(self.pieces), "sha256": "", "declared": {}, "report": {}}
        return httpx2.Response(201, json=dataset | {"created": "2026-01-01T00:00:00Z"})


def test_a_file_is_streamed_from_the_disk(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "large"
    path.write_bytes(bytes(2**20))
    transport = Counting()
    with Client("http://nowhere", transport=transport) as client:
        assert client.upload(path).bytes == 2**20
    assert max(transport.pieces) < 2**18


def test_the_client_needs_no_torch() -> None:
    code = (
        "import sys, service.client; print([m for m in ('torch', 'numpy', 'brdfcore', 'fastapi') if m in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_a_material_is_evaluated_and_integrated(client: Client) -> None:
    material = bc.material("lambert(kd=[0.5, 0.2]) + ward_bounded(isotropic, rs=0.3, a=0.2)")
    angles = {"theta_i_deg": np.array([30.0]), "phi_i_deg": [0], "theta_o_deg": [30], "phi_o_deg": [180.0]}
    for given in (material, str(material), material.to_json()):
        assert client.evaluate(given, **angles).material == str(material)  # type: ignore[arg-type]
    wi, wo = (torch.tensor([w], dtype=torch.float64) for w in ([0.6, 0.0, 0.8], [0.0, 0.0, 1.0]))
    assert client.evaluate(material, wi=wi, wo=wo).f == material.f(wi, wo).tolist()
    found = client.albedo(material, np.array([0.0, 60.0]), phi_deg=10, tolerance=1e-3)
    assert found.certificate is None
    told = client.albedo(material, [0.0], certificate=True).certificate
    assert told is not None
    assert told.verdict == bc.certify(material).verdict
    theta = torch.deg2rad(torch.tensor([0.0, 60.0], dtype=torch.float64))
    own = bc.albedo(material, theta, tolerance=1e-3).values.tolist()
    assert found.values == [pytest.approx(row, rel=1e-9) for row in own]
    assert (found.met, found.tolerance, found.phi_deg) == (True, 1e-3, 10.0)
    with pytest.raises(ProblemError, match="in full"):
        client.evaluate(material, wi=wi)


def test_a_table_is_made_and_fetched(client: Client, tmp_path: pathlib.Path) -> None:
    table = client.albedo_table("oren_nayar(kd=0.5)", {"oren_nayar.sigma": (0.1, 0.8)}, tolerance=1e-3)
    assert (table.job_status, table.result.met) == ("succeeded", True)
    assert [axis.name for axis in table.result.axes] == ["theta_deg", "oren_nayar.sigma"]
    assert repr(table).startswith(f"TableResult({table.id}, 'oren_nayar(")
    for kind in ("npz", "json"):
        file = tmp_path / f"table.{kind}"
        file.write_bytes(table.content(kind))
        assert bc.AlbedoTable.load(file).hash == table.result.hash
    assert client.get_table(table.id).result == table.result
    table.delete()
    with pytest.raises(ProblemError, match="Expected the id of a table"):
        table.refresh()


def test_a_table_that_failed_or_is_not_made_is_an_exception() -> None:
    request = {"material": "lambert", "axes": {}, "tolerance": 1e-4}
    failed, running = (
        fit_view(status, request=request, error=e) for status, e in (("failed", "No."), ("running", None))
    )
    with scripted(lambda _: httpx2.Response(200, json=failed)) as client, pytest.raises(JobFailedError, match="No"):
        client.albedo_table("lambert")
    with scripted(lambda _: httpx2.Response(202, json=running)) as client:
        table = client.albedo_table("lambert", wait=False)
        with pytest.raises(JobUnfinishedError, match=r"Expected table f1 to have succeeded, but it is running\."):
            _ = table.result
        with pytest.raises(
            WaitError, match=r"Expected /v1/albedo/f1 to be finished within 0\.\d+ s, but it is not\. Wait on"
        ):
            table.wait(timeout=0.01)
        assert table.cancel().job_status == "running"


def test_a_scene_is_rendered_and_fetched(client: Client) -> None:
    scene = bc.render.Scene.load("ashikhmin_shirley_figure_4")
    scene = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, width=8, height=6))
    told: list[float] = []
    made = client.render(scene, tolerance=0.01, samples=4, progress=lambda now: told.append(now.fraction))
    assert (made.job_status, told[-1], made.result.plan.tolerance) == ("succeeded", 1.0, 0.01)
    assert made.image().startswith(b"\x89PNG")
    assert np.load(io.BytesIO(made.image("npy"))).shape == (6, 8, 3)
    assert client.get_render(made.id).result == made.result
    assert repr(made) == f"RenderResult({made.id}, '{len(scene.objects)} objects', succeeded)"
    made.delete()
    with pytest.raises(ProblemError, match="Expected the id of a render"):
        made.refresh()


def test_a_sphere_has_the_colour_of_its_channels(client: Client) -> None:
    red = "lambert(kd=[0.6, 0.1, 0.1])"
    assert client.sphere(red, ["450", "550", "650"]) != client.sphere(red)
    assert client.sphere(bc.material(red), size=32) == client.sphere(red, ["r", "g", "b"], 32)


def test_a_render_that_is_not_made_is_an_exception() -> None:
    request = {"scene": "kurt_figure_12", "tolerance": 1e-3, "samples": 4, "noise": None, "seed": 0}
    with scripted(lambda _: httpx2.Response(202, json=fit_view("running", request=request))) as client:
        running = client.render("kurt_figure_12", wait=False)
        assert repr(running) == "RenderResult(f1, 'kurt_figure_12', running)"
        with pytest.raises(JobUnfinishedError, match=r"Expected render f1 to have succeeded, but it is running\."):
            _ = running.result


def test_many_fits_at_once_keep_their_order(client: Client) -> None:
    given = measured_diffuser()
    double = given | {"values": [[2 * value for value in row] for row in given["values"]]}
    steep = given | {"theta_i_deg": [89.0] * 24}
    made = client.fits([given, steep, double], model="lambert", max_theta_deg=80)
    assert [fit.job_status for fit in made] == ["succeeded", "failed", "succeeded"]
    assert made[2].parameters["lambert.kd"] == pytest.approx(2 * made[0].parameters["lambert.kd"], rel=1e-9)  # type: ignore[operator]


def test_the_newest_fits_are_listed(client: Client) -> None:
    made = [client.fit(measured_diffuser(), model="lambert", seed=seed).id for seed in range(2)]
    assert [fit.id for fit in client.recent()] == made[::-1]
    assert client.recent(1, "succeeded")[0].id == made[1]
    assert client.recent(status="failed") == []


def test_progress_is_told_and_a_result_is_a_material(client: Client) -> None:
    told: list[float] = []
    fit = client.fit(as_samples(), model="lambert", progress=lambda now: told.append(now.fraction))
    assert told[-1] == 1.0
    assert told == sorted(told)
    assert fit.progress is not None
    assert str(fit.material) == fit.result.material_text
    assert client.fit(as_samples(), model="lambert").reused == fit.id
