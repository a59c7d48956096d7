"""The client that waits for every answer."""

import time
from collections.abc import Iterable, Sequence
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
from .batches import BatchResult
from .calls import Ask, Call, Pause, Tell
from .errors import FitFailedError
from .fits import FitResult
from .persistence import persistent, settings
from .renders import RenderResult
from .requests import Axes, Declared, Directions, File, FitOptions, Material, RenderOptions, Scene
from .tables import TableResult

_T = TypeVar("_T")


class Client:
    """The service at a URL; a context manager. `transport` takes the place of the network, for tests."""

    def __init__(self, url: str, api_key: str | None = None, transport: httpx2.BaseTransport | None = None) -> None:
        self._http = httpx2.Client(**settings(url, api_key), transport=transport)

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
        return self._run(requests.models())

    def formats(self) -> list[FormatView]:
        """Every format of measured files that is read, and whether one file of it can be uploaded."""
        return self._run(requests.formats())

    def upload(self, path: File, **declared: Unpack[Declared]) -> DatasetView:
        """The dataset made of a measured file, which is streamed from the disk."""
        return self._run(requests.upload(path, declared))

    def fit(
        self,
        data: Any,
        *,
        model: str | None = None,
        models: Sequence[str] | None = None,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
        **options: Unpack[FitOptions],
    ) -> FitResult:
        """The fit of a model to a measured file, a dataset, arrays by name, or an object like brdfcore.Samples.

        Of several models the result is the best one's, and `FitResult.comparison` has them all.
        With wait=True the fit is finished on return, and `progress` is called with how far it is; raises
        FitFailedError, and WaitError after `timeout` s. With wait=False it may still run: see FitResult.wait.
        """
        asked = requests.fit(data, model, models, options, wait=wait, timeout=timeout, progress=progress)
        return FitResult(self._run, self._run(asked))

    def fits(
        self,
        data: Iterable[Any],
        *,
        model: str | None = None,
        models: Sequence[str] | None = None,
        **options: Unpack[FitOptions],
    ) -> list[FitResult]:
        """The fits, as `fit` gives them, to each of the data, submitted all together and finished on return, in order.

        One that failed is among them, its `job_status` "failed".
        """
        made = [self.fit(one, model=model, models=models, wait=False, **options) for one in data]
        for fit in made:
            try:
                fit.wait()
            except FitFailedError:
                fit.refresh()
        return made

    def batch(
        self, data: Iterable[File | DatasetView], *, models: Sequence[str], **options: Unpack[FitOptions]
    ) -> BatchResult:
        """Fits of every model to every file or dataset, which run on; see BatchResult.wait, .rows and .csv."""
        return BatchResult(self._run, self._run(requests.batch(data, models, options)))

    def get_batch(self, batch_id: str) -> BatchResult:
        """The batch of that id as it stands."""
        return BatchResult(self._run, self._run(requests.get_batch(batch_id)))

    def recent(self, limit: int = 20, status: JobStatus | None = None) -> list[FitSummary]:
        """The newest fits without their results, up to 100, of a status where one is given."""
        return self._run(requests.recent(limit, status))

    def get(self, fit_id: str) -> FitResult:
        """The fit of that id as it stands."""
        return FitResult(self._run, self._run(requests.get_fit(fit_id)))

    def evaluate(self, material: Material, **directions: Unpack[Directions]) -> EvaluationView:
        """The BRDF, density and weight of a material at pairs of directions, wi and wo or the four angles.

        A material is a text, a preset's name, its JSON, or an object like brdfcore.Material.
        """
        return self._run(requests.evaluation(material, **directions))

    def albedo(
        self,
        material: Material,
        theta_deg: Any,
        phi_deg: float = 0.0,
        tolerance: float = 1e-6,
        *,
        certificate: bool = False,
    ) -> AlbedoView:
        """The directional albedos of a material, given as in `evaluate`, for polar angles [degrees].

        certificate   whether the answer's `certificate` says if the material could exist
        """
        return self._run(requests.albedo(material, theta_deg, phi_deg, tolerance, certificate=certificate))

    def sphere(self, material: Material, channels: Sequence[str] | None = None, size: int = 160) -> bytes:
        """A lit sphere of a material, given as in `evaluate`, as a PNG file; `channels` give it its colour."""
        return self._run(requests.sphere(material, channels, size))

    def albedo_table(
        self,
        material: Material,
        axes: Axes | None = None,
        tolerance: float = 1e-4,
        *,
        wait: bool = True,
        timeout: float | None = None,
    ) -> TableResult:
        """The table of albedos of a material, given as in `evaluate`, over axes such as {"theta_deg": (0, 85)}.

        With wait=True it is finished on return; raises JobFailedError, and WaitError after `timeout` s.
        """
        return TableResult(self._run, self._run(requests.table(material, axes, tolerance, wait=wait, timeout=timeout)))

    def get_table(self, table_id: str) -> TableResult:
        """The table of that id as it stands."""
        return TableResult(self._run, self._run(requests.get_table(table_id)))

    def render(
        self,
        scene: Scene,
        *,
        wait: bool = True,
        timeout: float | None = None,
        progress: Tell | None = None,
        **options: Unpack[RenderOptions],
    ) -> RenderResult:
        """The image of a scene: the name of a shipped one, its JSON, or an object like brdfcore.render.Scene.

        With wait=True it is finished on return; raises JobFailedError, and WaitError after `timeout` s.
        """
        asked = requests.render(scene, options, wait=wait, timeout=timeout, progress=progress)
        return RenderResult(self._run, self._run(asked))

    def get_render(self, render_id: str) -> RenderResult:
        """The render of that id as it stands."""
        return RenderResult(self._run, self._run(requests.get_render(render_id)))

    def _run(self, call: Call[_T]) -> _T:
        """The result of a call, its steps taken one after the other."""
        steps, answer = persistent(call, self._http.base_url), None
        try:
            while True:
                answer = self._taken(steps.send(answer))
        except StopIteration as done:
            result: _T = done.value
            return result
        finally:
            steps.close()

    def _taken(self, step: Ask | Pause) -> httpx2.Response | httpx2.TransportError | None:
        if isinstance(step, Pause):
            time.sleep(step.seconds)
            return None
        try:
            return self._http.request(step.method, step.path, **step.what)
        except httpx2.TransportError as error:
            return error
