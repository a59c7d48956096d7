"""The client that is awaited."""

import asyncio
import os
from collections.abc import AsyncIterator, Iterable, Sequence
from types import TracebackType
from typing import Any, Self, TypeVar, Unpack

import httpx2

from ..schemas import (
    AlbedoView,
    DatasetView,
    EvaluationView,
    FitSummary,
    FormatView,
    JobStatus,
    ModelView,
)
from . import requests
from .batches import AsyncBatchResult
from .calls import Ask, Call, Pause, Tell
from .errors import FitFailedError
from .fits import AsyncFitResult
from .persistence import persistent, settings
from .renders import AsyncRenderResult
from .requests import Axes, Declared, Directions, File, FitOptions, Material, RenderOptions, Scene
from .tables import AsyncTableResult

_PIECE = 2**20  # bytes of a file that are sent at once
_T = TypeVar("_T")


class AsyncClient:
    """`Client`, to be awaited; an async context manager."""

    def __init__(
        self, url: str, api_key: str | None = None, transport: httpx2.AsyncBaseTransport | None = None
    ) -> None:
        self._http = httpx2.AsyncClient(**settings(url, api_key), transport=transport)

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
        return await self._run(requests.models())

    async def formats(self) -> list[FormatView]:
        """Every format of measured files that is read, as `Client.formats` gives them."""
        return await self._run(requests.formats())

    async def upload(self, path: File, **declared: Unpack[Declared]) -> DatasetView:
        """The dataset made of a measured file, which is streamed from the disk."""
        return await self._run(requests.upload(path, declared))

    async def fit(
        self,
        data: Any,
        *,
        model: str | None = None,
        models: Sequence[str] | None = None,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
        **options: Unpack[FitOptions],
    ) -> AsyncFitResult:
        """The fit of a model, or the best of several, as `Client.fit` gives it."""
        asked = requests.fit(data, model, models, options, wait=wait, timeout=timeout, progress=progress)
        return AsyncFitResult(self._run, await self._run(asked))

    async def fits(
        self,
        data: Iterable[Any],
        *,
        model: str | None = None,
        models: Sequence[str] | None = None,
        **options: Unpack[FitOptions],
    ) -> list[AsyncFitResult]:
        """The fits to each of the data, as `Client.fits` gives them."""
        made = [await self.fit(one, model=model, models=models, wait=False, **options) for one in data]
        for fit in made:
            try:
                await fit.wait()
            except FitFailedError:
                await fit.refresh()
        return made

    async def batch(
        self, data: Iterable[File | DatasetView], *, models: Sequence[str], **options: Unpack[FitOptions]
    ) -> AsyncBatchResult:
        """Fits of every model to every file or dataset, as `Client.batch` gives them."""
        return AsyncBatchResult(self._run, await self._run(requests.batch(data, models, options)))

    async def get_batch(self, batch_id: str) -> AsyncBatchResult:
        """The batch of that id as it stands."""
        return AsyncBatchResult(self._run, await self._run(requests.get_batch(batch_id)))

    async def recent(self, limit: int = 20, status: JobStatus | None = None) -> list[FitSummary]:
        """The newest fits without their results, as `Client.recent` gives them."""
        return await self._run(requests.recent(limit, status))

    async def get(self, fit_id: str) -> AsyncFitResult:
        """The fit of that id as it stands."""
        return AsyncFitResult(self._run, await self._run(requests.get_fit(fit_id)))

    async def evaluate(self, material: Material, **directions: Unpack[Directions]) -> EvaluationView:
        """The BRDF, density and weight of a material, as `Client.evaluate` gives them."""
        return await self._run(requests.evaluation(material, **directions))

    async def albedo(
        self,
        material: Material,
        theta_deg: Any,
        phi_deg: float = 0.0,
        tolerance: float = 1e-6,
        *,
        certificate: bool = False,
    ) -> AlbedoView:
        """The directional albedos of a material for polar angles [degrees], as `Client.albedo` gives them."""
        return await self._run(requests.albedo(material, theta_deg, phi_deg, tolerance, certificate=certificate))

    async def sphere(self, material: Material, channels: Sequence[str] | None = None, size: int = 160) -> bytes:
        """A lit sphere of a material as the bytes of a PNG file, as `Client.sphere` gives it."""
        return await self._run(requests.sphere(material, channels, size))

    async def albedo_table(
        self,
        material: Material,
        axes: Axes | None = None,
        tolerance: float = 1e-4,
        *,
        wait: bool = True,
        timeout: float | None = None,
    ) -> AsyncTableResult:
        """The table of albedos of a material, as `Client.albedo_table` gives it."""
        asked = requests.table(material, axes, tolerance, wait=wait, timeout=timeout)
        return AsyncTableResult(self._run, await self._run(asked))

    async def get_table(self, table_id: str) -> AsyncTableResult:
        """The table of that id as it stands."""
        return AsyncTableResult(self._run, await self._run(requests.get_table(table_id)))

    async def render(
        self,
        scene: Scene,
        *,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
        **options: Unpack[RenderOptions],
    ) -> AsyncRenderResult:
        """The image of a scene, as `Client.render` gives it."""
        asked = requests.render(scene, options, wait=wait, timeout=timeout, progress=progress)
        return AsyncRenderResult(self._run, await self._run(asked))

    async def get_render(self, render_id: str) -> AsyncRenderResult:
        """The render of that id as it stands."""
        return AsyncRenderResult(self._run, await self._run(requests.get_render(render_id)))

    async def _run(self, call: Call[_T]) -> _T:
        """The result of a call, its steps taken one after the other."""
        steps, answer = persistent(call, self._http.base_url), None
        try:
            while True:
                answer = await self._taken(steps.send(answer))
        except StopIteration as done:
            result: _T = done.value
            return result
        finally:
            steps.close()

    async def _taken(self, step: Ask | Pause) -> httpx2.Response | httpx2.TransportError | None:
        if isinstance(step, Pause):
            await asyncio.sleep(step.seconds)
            return None
        what = step.what
        if hasattr(what.get("content"), "read"):
            size = os.fstat(what["content"].fileno()).st_size
            what["headers"] = {**what.get("headers", {}), "content-length": str(size)}
            what["content"] = _pieces(what["content"])
        try:
            return await self._http.request(step.method, step.path, **what)
        except httpx2.TransportError as error:
            return error


async def _pieces(file: Any) -> AsyncIterator[bytes]:
    """A file's bytes, read beside the loop."""
    while piece := await asyncio.to_thread(file.read, _PIECE):
        yield piece
