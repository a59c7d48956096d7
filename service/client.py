"""Clients of the service, one that waits and one to await; they need httpx2 and pydantic, neither torch nor brdfcore.

with Client("http://127.0.0.1:8000") as client:
    fit = client.fit("garnet_red.brdf", model="lambert + kurt", quantity="brdf")
    print(fit.report())
    print(client.albedo("lambert + kurt", [0, 60, 89]).values)

Every request can be sent again without doing anything twice, and is, where the service is busy or does not answer:
after the time that it names in Retry-After, else after a pause that doubles.
"""

import asyncio
import os
import time
import uuid
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from types import TracebackType
from typing import Any, Self, TypedDict, TypeVar, Unpack

import httpx2

from . import client_calls as calls
from .client_calls import Ask, Call, Pause, Tell
from .client_errors import (
    ClientError,
    FitFailedError,
    FitUnfinishedError,
    JobFailedError,
    JobUnfinishedError,
    ProblemError,
    UnreachableError,
    WaitError,
)
from .client_renders import AsyncRenderResult, RenderResult, Scene, rendered
from .client_results import (
    AsyncBatchResult,
    AsyncFitResult,
    AsyncTableResult,
    BatchResult,
    ExportedFile,
    FitResult,
    TableResult,
)
from .schemas import (
    AlbedoView,
    BatchView,
    DatasetView,
    EvaluationView,
    FitPage,
    FitSummary,
    FitView,
    FormatList,
    FormatView,
    JobStatus,
    ModelList,
    ModelView,
    Problem,
    RenderView,
    TableView,
)

__all__ = [
    "AsyncBatchResult",
    "AsyncClient",
    "AsyncFitResult",
    "AsyncRenderResult",
    "AsyncTableResult",
    "BatchResult",
    "Client",
    "ClientError",
    "ExportedFile",
    "FitFailedError",
    "FitOptions",
    "FitResult",
    "FitUnfinishedError",
    "JobFailedError",
    "JobUnfinishedError",
    "ProblemError",
    "RenderResult",
    "TableResult",
    "UnreachableError",
    "WaitError",
]

TRIES = 4  # of one request
_BUSY = (429, 503)
_FIRST, _LONGEST = 0.25, 30.0  # pauses between them [s]
_PIECE = 2**20  # bytes of a file that are sent at once
_DECLARED = ("format", "quantity", "angle_unit", "columns")  # of a file
_T = TypeVar("_T")
Material = Any  # a text, a preset's name, its JSON, or an object like brdfcore.Material


class FitOptions(TypedDict, total=False):
    """What may be asked of a fit, as fields of POST /v1/fits; format to columns declare what a file does not say."""

    loss: str
    optimizer: str
    fixed: Mapping[str, float | Sequence[float]]
    gray: Sequence[str]
    per_channel: Sequence[str]
    seed: int
    bounds: Mapping[str, Sequence[float]]
    starts: Sequence[Mapping[str, float | Sequence[float]]]
    robust: str | None
    robust_scale: float | None
    max_theta_deg: float | None
    conserve_energy: bool
    format: str | None
    quantity: str | None
    angle_unit: str | None
    columns: str | None


class _Shared:
    """What both clients ask, as calls."""

    @staticmethod
    def _fit(
        data: Any, model: str, options: FitOptions, *, wait: bool, timeout: float | None, progress: Tell | None
    ) -> Call[FitView]:
        begun = time.monotonic()
        declared = {name: options.get(name) for name in _DECLARED}
        asked = {name: value for name, value in options.items() if name not in declared}
        body = yield from calls.fit_body(data, {"model": model, **asked}, declared)
        at_once = wait and progress is None
        view = yield from calls.submitted("/v1/fits", body, FitView, at_once, timeout)
        if not wait:
            return view
        left = None if timeout is None else max(0.0, timeout - (time.monotonic() - begun))
        return (yield from calls.finished("/v1/fits", view, "fit", FitFailedError, left, progress))

    @staticmethod
    def _batch(data: Iterable[Any], models: Sequence[str], options: FitOptions) -> Call[BatchView]:
        declared = {name: options.get(name) for name in _DECLARED}
        body = {name: calls.plain(value) for name, value in options.items() if name not in declared}
        body |= {"models": list(models), "datasets": []}
        for one in data:
            dataset = one if isinstance(one, DatasetView) else (yield from calls.uploaded(one, declared))
            body["datasets"].append(dataset.id)
        headers = {"idempotency-key": uuid.uuid4().hex}
        return (yield from calls.read(BatchView, "POST", "/v1/batches", json=body, headers=headers))

    @staticmethod
    def _table(
        material: Material, axes: Mapping[str, Any] | None, tolerance: float, wait: bool, timeout: float | None
    ) -> Call[TableView]:
        begun = time.monotonic()
        body = {"material": calls.material_of(material), "axes": calls.plain(axes or {}), "tolerance": tolerance}
        view = yield from calls.submitted("/v1/albedo", body, TableView, wait, timeout)
        if not wait:
            return view
        left = None if timeout is None else max(0.0, timeout - (time.monotonic() - begun))
        return (yield from calls.finished("/v1/albedo", view, "table", JobFailedError, left, None))

    @staticmethod
    def _evaluation(material: Material, directions: Mapping[str, Any]) -> Call[EvaluationView]:
        given = {name: calls.plain(value) for name, value in directions.items() if value is not None}
        body = {"material": calls.material_of(material), **given}
        return calls.read(EvaluationView, "POST", "/v1/evaluate", json=body)

    @staticmethod
    def _albedo(material: Material, theta_deg: Any, phi_deg: float, tolerance: float) -> Call[AlbedoView]:
        body = {"theta_deg": calls.plain(theta_deg), "phi_deg": phi_deg, "tolerance": tolerance}
        return calls.read(AlbedoView, "POST", "/v1/albedo", json={"material": calls.material_of(material), **body})

    @staticmethod
    def _sphere(material: Material, channels: Sequence[str] | None, size: int) -> Call[bytes]:
        body = {"material": calls.material_of(material), "channels": calls.plain(channels), "size": size}
        return calls.content("POST", "/v1/sphere", json=body)


class Client(_Shared):
    """The service at a URL; a context manager. `transport` takes the place of the network, for tests."""

    def __init__(self, url: str, api_key: str | None = None, transport: httpx2.BaseTransport | None = None) -> None:
        self._http = httpx2.Client(**_settings(url, api_key), transport=transport)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the connections."""
        self._http.close()

    def models(self) -> list[ModelView]:
        """Every model that a fit's text may name."""
        return self._run(calls.read(ModelList, "GET", "/v1/models")).items

    def formats(self) -> list[FormatView]:
        """Every format of measured files that is read, and whether one file of it can be uploaded."""
        return self._run(calls.read(FormatList, "GET", "/v1/formats")).items

    def upload(
        self,
        path: str | os.PathLike[str],
        *,
        format: str | None = None,  # noqa: A002 - as in brdfcore.read
        quantity: str | None = None,
        angle_unit: str | None = None,
        columns: str | None = None,
    ) -> DatasetView:
        """The dataset made of a measured file, which is streamed from the disk."""
        declared = {"format": format, "quantity": quantity, "angle_unit": angle_unit, "columns": columns}
        return self._run(calls.uploaded(path, declared))

    def fit(
        self,
        data: Any,
        *,
        model: str,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
        **options: Unpack[FitOptions],
    ) -> FitResult:
        """The fit of a model to a measured file, a dataset, arrays by name, or an object like brdfcore.Samples.

        With wait=True the fit is finished on return, and `progress` is called with how far it is; raises
        FitFailedError, and WaitError after `timeout` s. With wait=False it may still run: see FitResult.wait.
        """
        asked = self._fit(data, model, options, wait=wait, timeout=timeout, progress=progress)
        return FitResult(self._run, self._run(asked))

    def fits(self, data: Iterable[Any], *, model: str, **options: Unpack[FitOptions]) -> list[FitResult]:
        """The fits of one model to each of the data, submitted all together and finished on return, in their order.

        One that failed is among them, its `job_status` "failed".
        """
        made = [self.fit(one, model=model, wait=False, **options) for one in data]
        for fit in made:
            try:
                fit.wait()
            except FitFailedError:
                fit.refresh()
        return made

    def batch(
        self,
        data: "Iterable[str | os.PathLike[str] | DatasetView]",
        *,
        models: Sequence[str],
        **options: Unpack[FitOptions],
    ) -> BatchResult:
        """Fits of every model to every file or dataset, which run on; see BatchResult.wait, .rows and .csv."""
        return BatchResult(self._run, self._run(self._batch(data, models, options)))

    def get_batch(self, batch_id: str) -> BatchResult:
        """The batch of that id as it stands."""
        return BatchResult(self._run, self._run(calls.read(BatchView, "GET", f"/v1/batches/{batch_id}")))

    def recent(self, limit: int = 20, status: JobStatus | None = None) -> list[FitSummary]:
        """The newest fits without their results, up to 100, of a status where one is given."""
        asked = {"limit": limit} | ({"status": status} if status else {})
        return self._run(calls.read(FitPage, "GET", "/v1/fits", params=asked)).items

    def get(self, fit_id: str) -> FitResult:
        """The fit of that id as it stands."""
        return FitResult(self._run, self._run(calls.read(FitView, "GET", f"/v1/fits/{fit_id}")))

    def evaluate(
        self,
        material: Material,
        *,
        wi: Any = None,
        wo: Any = None,
        theta_i_deg: Any = None,
        phi_i_deg: Any = None,
        theta_o_deg: Any = None,
        phi_o_deg: Any = None,
    ) -> EvaluationView:
        """The BRDF, density and weight of a material at pairs of directions, wi and wo or the four angles.

        A material is a text, a preset's name, its JSON, or an object like brdfcore.Material.
        """
        given = {"wi": wi, "wo": wo, "theta_i_deg": theta_i_deg, "phi_i_deg": phi_i_deg}
        given |= {"theta_o_deg": theta_o_deg, "phi_o_deg": phi_o_deg}
        return self._run(self._evaluation(material, given))

    def albedo(self, material: Material, theta_deg: Any, phi_deg: float = 0.0, tolerance: float = 1e-6) -> AlbedoView:
        """The directional albedos of a material, given as in `evaluate`, for polar angles [degrees]."""
        return self._run(self._albedo(material, theta_deg, phi_deg, tolerance))

    def sphere(self, material: Material, channels: Sequence[str] | None = None, size: int = 160) -> bytes:
        """A lit sphere of a material, given as in `evaluate`, as a PNG file; `channels` give it its colour."""
        return self._run(self._sphere(material, channels, size))

    def albedo_table(
        self,
        material: Material,
        axes: "Mapping[str, tuple[float, float] | None] | None" = None,
        tolerance: float = 1e-4,
        *,
        wait: bool = True,
        timeout: float | None = None,
    ) -> TableResult:
        """The table of albedos of a material, given as in `evaluate`, over axes such as {"theta_deg": (0, 85)}.

        With wait=True it is finished on return; raises JobFailedError, and WaitError after `timeout` s.
        """
        return TableResult(self._run, self._run(self._table(material, axes, tolerance, wait, timeout)))

    def get_table(self, table_id: str) -> TableResult:
        """The table of that id as it stands."""
        return TableResult(self._run, self._run(calls.read(TableView, "GET", f"/v1/albedo/{table_id}")))

    def render(
        self,
        scene: Scene,
        tolerance: float = 1e-3,
        *,
        samples: int | None = None,
        noise: float | None = None,
        seed: int = 0,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
    ) -> RenderResult:
        """The image of a scene: the name of a shipped one, its JSON, or an object like brdfcore.render.Scene.

        With wait=True it is finished on return; raises JobFailedError, and WaitError after `timeout` s.
        """
        asked = {"tolerance": tolerance, "samples": samples, "noise": noise, "seed": seed}
        return RenderResult(self._run, self._run(rendered(scene, asked, wait, timeout, progress)))

    def get_render(self, render_id: str) -> RenderResult:
        """The render of that id as it stands."""
        return RenderResult(self._run, self._run(calls.read(RenderView, "GET", f"/v1/renders/{render_id}")))

    def _run(self, call: Call[_T]) -> _T:
        """The result of a call, its steps taken one after the other."""
        answer: Any = None
        try:
            while True:
                step = call.send(answer)
                answer = None
                if isinstance(step, Pause):
                    time.sleep(step.seconds)
                else:
                    answer = self._answer(step)
        except StopIteration as done:
            result: _T = done.value
            return result
        finally:
            call.close()  # closes the file that was to be sent

    def _answer(self, ask: Ask) -> httpx2.Response:
        for attempt in range(TRIES):
            try:
                answer = self._http.request(ask.method, ask.path, **_rewound(ask.what))
            except httpx2.TransportError as error:
                if attempt == TRIES - 1:
                    raise _unreachable(self._http.base_url, error) from error
                time.sleep(_pause(attempt))
            else:
                if answer.status_code not in _BUSY or attempt == TRIES - 1:
                    break
                time.sleep(_pause(attempt, answer))
        return _checked(answer)


class AsyncClient(_Shared):
    """The same, to be awaited; an async context manager."""

    def __init__(
        self, url: str, api_key: str | None = None, transport: httpx2.AsyncBaseTransport | None = None
    ) -> None:
        self._http = httpx2.AsyncClient(**_settings(url, api_key), transport=transport)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Let go of the connections."""
        await self._http.aclose()

    async def models(self) -> list[ModelView]:
        """Every model that a fit's text may name."""
        return (await self._run(calls.read(ModelList, "GET", "/v1/models"))).items

    async def formats(self) -> list[FormatView]:
        """Every format of measured files that is read, as `Client.formats` gives them."""
        return (await self._run(calls.read(FormatList, "GET", "/v1/formats"))).items

    async def upload(
        self,
        path: str | os.PathLike[str],
        *,
        format: str | None = None,  # noqa: A002 - as in brdfcore.read
        quantity: str | None = None,
        angle_unit: str | None = None,
        columns: str | None = None,
    ) -> DatasetView:
        """The dataset made of a measured file, which is streamed from the disk."""
        declared = {"format": format, "quantity": quantity, "angle_unit": angle_unit, "columns": columns}
        return await self._run(calls.uploaded(path, declared))

    async def fit(
        self,
        data: Any,
        *,
        model: str,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
        **options: Unpack[FitOptions],
    ) -> AsyncFitResult:
        """The fit of a model, as `Client.fit` gives it."""
        asked = self._fit(data, model, options, wait=wait, timeout=timeout, progress=progress)
        return AsyncFitResult(self._run, await self._run(asked))

    async def fits(self, data: Iterable[Any], *, model: str, **options: Unpack[FitOptions]) -> list[AsyncFitResult]:
        """The fits of one model to each of the data, as `Client.fits` gives them."""
        made = [await self.fit(one, model=model, wait=False, **options) for one in data]
        for fit in made:
            try:
                await fit.wait()
            except FitFailedError:
                await fit.refresh()
        return made

    async def batch(
        self,
        data: "Iterable[str | os.PathLike[str] | DatasetView]",
        *,
        models: Sequence[str],
        **options: Unpack[FitOptions],
    ) -> AsyncBatchResult:
        """Fits of every model to every file or dataset, as `Client.batch` gives them."""
        return AsyncBatchResult(self._run, await self._run(self._batch(data, models, options)))

    async def get_batch(self, batch_id: str) -> AsyncBatchResult:
        """The batch of that id as it stands."""
        return AsyncBatchResult(self._run, await self._run(calls.read(BatchView, "GET", f"/v1/batches/{batch_id}")))

    async def recent(self, limit: int = 20, status: JobStatus | None = None) -> list[FitSummary]:
        """The newest fits without their results, as `Client.recent` gives them."""
        asked = {"limit": limit} | ({"status": status} if status else {})
        return (await self._run(calls.read(FitPage, "GET", "/v1/fits", params=asked))).items

    async def get(self, fit_id: str) -> AsyncFitResult:
        """The fit of that id as it stands."""
        return AsyncFitResult(self._run, await self._run(calls.read(FitView, "GET", f"/v1/fits/{fit_id}")))

    async def evaluate(
        self,
        material: Material,
        *,
        wi: Any = None,
        wo: Any = None,
        theta_i_deg: Any = None,
        phi_i_deg: Any = None,
        theta_o_deg: Any = None,
        phi_o_deg: Any = None,
    ) -> EvaluationView:
        """The BRDF, density and weight of a material, as `Client.evaluate` gives them."""
        given = {"wi": wi, "wo": wo, "theta_i_deg": theta_i_deg, "phi_i_deg": phi_i_deg}
        given |= {"theta_o_deg": theta_o_deg, "phi_o_deg": phi_o_deg}
        return await self._run(self._evaluation(material, given))

    async def albedo(
        self, material: Material, theta_deg: Any, phi_deg: float = 0.0, tolerance: float = 1e-6
    ) -> AlbedoView:
        """The directional albedos of a material for polar angles [degrees]."""
        return await self._run(self._albedo(material, theta_deg, phi_deg, tolerance))

    async def sphere(self, material: Material, channels: Sequence[str] | None = None, size: int = 160) -> bytes:
        """A lit sphere of a material as the bytes of a PNG file, as `Client.sphere` gives it."""
        return await self._run(self._sphere(material, channels, size))

    async def albedo_table(
        self,
        material: Material,
        axes: "Mapping[str, tuple[float, float] | None] | None" = None,
        tolerance: float = 1e-4,
        *,
        wait: bool = True,
        timeout: float | None = None,
    ) -> AsyncTableResult:
        """The table of albedos of a material, as `Client.albedo_table` gives it."""
        return AsyncTableResult(self._run, await self._run(self._table(material, axes, tolerance, wait, timeout)))

    async def get_table(self, table_id: str) -> AsyncTableResult:
        """The table of that id as it stands."""
        return AsyncTableResult(self._run, await self._run(calls.read(TableView, "GET", f"/v1/albedo/{table_id}")))

    async def render(
        self,
        scene: Scene,
        tolerance: float = 1e-3,
        *,
        samples: int | None = None,
        noise: float | None = None,
        seed: int = 0,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
    ) -> AsyncRenderResult:
        """The image of a scene, as `Client.render` gives it."""
        asked = {"tolerance": tolerance, "samples": samples, "noise": noise, "seed": seed}
        return AsyncRenderResult(self._run, await self._run(rendered(scene, asked, wait, timeout, progress)))

    async def get_render(self, render_id: str) -> AsyncRenderResult:
        """The render of that id as it stands."""
        return AsyncRenderResult(self._run, await self._run(calls.read(RenderView, "GET", f"/v1/renders/{render_id}")))

    async def _run(self, call: Call[_T]) -> _T:
        answer: Any = None
        try:
            while True:
                step = call.send(answer)
                answer = None
                if isinstance(step, Pause):
                    await asyncio.sleep(step.seconds)
                else:
                    answer = await self._answer(step)
        except StopIteration as done:
            result: _T = done.value
            return result
        finally:
            call.close()

    async def _answer(self, ask: Ask) -> httpx2.Response:
        for attempt in range(TRIES):
            what = _rewound(ask.what)
            if hasattr(what.get("content"), "read"):
                size = os.fstat(what["content"].fileno()).st_size
                what["headers"] = {**what.get("headers", {}), "content-length": str(size)}
                what["content"] = _pieces(what["content"])
            try:
                answer = await self._http.request(ask.method, ask.path, **what)
            except httpx2.TransportError as error:
                if attempt == TRIES - 1:
                    raise _unreachable(self._http.base_url, error) from error
                await asyncio.sleep(_pause(attempt))
            else:
                if answer.status_code not in _BUSY or attempt == TRIES - 1:
                    break
                await asyncio.sleep(_pause(attempt, answer))
        return _checked(answer)


def _settings(url: str, api_key: str | None) -> dict[str, Any]:
    headers = {"authorization": f"Bearer {api_key}"} if api_key else {}
    return {"base_url": url, "headers": headers, "timeout": calls.LONGEST + 60}


async def _pieces(file: Any) -> AsyncIterator[bytes]:
    """A file's bytes, read beside the loop."""
    while piece := await asyncio.to_thread(file.read, _PIECE):
        yield piece


def _rewound(what: dict[str, Any]) -> dict[str, Any]:
    """The arguments of a request, a file among them at its beginning."""
    if hasattr(what.get("content"), "seek"):
        what["content"].seek(0)
    return dict(what)


def _pause(attempt: int, answer: httpx2.Response | None = None) -> float:
    """How long to leave the service alone [s]: what it asks for, else twice as long each time."""
    asked = answer.headers.get("retry-after", "") if answer is not None else ""
    return min(float(asked) if asked.isdecimal() else _FIRST * 2**attempt, _LONGEST)


def _unreachable(url: object, error: Exception) -> UnreachableError:
    return UnreachableError(f"Expected a service at {url}, got {type(error).__name__}: {error}. Is it running?")


def _checked(answer: httpx2.Response) -> httpx2.Response:
    """The answer; raises what it refuses."""
    if answer.is_success:
        return answer
    if answer.headers.get("content-type", "").startswith("application/problem+json"):
        raise ProblemError(Problem.model_validate_json(answer.content))
    detail = f"Expected an answer of this service at {answer.url}, got status {answer.status_code}. Check the URL."
    raise ProblemError(Problem(title=answer.reason_phrase, status=answer.status_code, detail=detail))
