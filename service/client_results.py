"""Jobs on the service, as the clients hand them out: fits and tables of albedos, to wait for or to await."""

import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar

from . import client_calls as calls
from .client_calls import Call, Tell
from .client_errors import FitFailedError, FitUnfinishedError, JobFailedError, JobUnfinishedError, WaitError
from .schemas import (
    BatchRow,
    BatchTable,
    BatchView,
    CertificateView,
    CostView,
    FitOutcome,
    FitView,
    Interval,
    JobStatus,
    JobView,
    ProgressView,
    TableOutcome,
    TableView,
)

if TYPE_CHECKING:
    from brdfcore.models.material import Material


@dataclass(frozen=True)
class ExportedFile:
    """A fitted material as another program's file, what it holds, and how far from the material that is."""

    content: bytes
    difference: float  # relative RMS difference of f cos theta_i [1]
    holds: str


View = TypeVar("View", bound=JobView)
Run = Callable[[Call[Any]], Any]  # takes the steps of a call and gives its result
Start = Callable[[Call[Any]], Awaitable[Any]]  # the same, to be awaited


class _Job(Generic[View]):
    """A job on the service. `job_status` says how it stands."""

    _path: ClassVar[str]
    _name: ClassVar[str]
    _failed: ClassVar[type[JobFailedError]] = JobFailedError
    view: View

    @property
    def id(self) -> str:
        """The job's id."""
        return self.view.id

    @property
    def job_status(self) -> JobStatus:
        """queued, running, succeeded, failed or cancelled, as of the last answer."""
        return self.view.status

    @property
    def progress(self) -> ProgressView | None:
        """How far it had come, as of the last answer."""
        return self.view.progress

    @property
    def reused(self) -> str | None:
        """The earlier job of the same work, whose result this is."""
        return self.view.reused

    def _finished(self, timeout: float | None, progress: Tell | None) -> Call[Self]:
        self.view = yield from calls.finished(self._path, self.view, self._name, self._failed, timeout, progress)
        return self

    def _answered(self, method: str, tail: str) -> Call[Self]:
        self.view = yield from calls.read(type(self.view), method, f"{self._path}/{self.id}{tail}")
        return self

    def _removed(self) -> Call[None]:
        yield from calls.content("DELETE", f"{self._path}/{self.id}")

    def _unfinished(self) -> str:
        return f"Expected {self._name} {self.id} to have succeeded, but it is {self.job_status}. Call wait()."


class _Fit(_Job[FitView]):
    """A fit on the service; all that is its result needs it to have succeeded."""

    _path, _name, _failed = "/v1/fits", "fit", FitFailedError

    def __repr__(self) -> str:
        model = self.view.request.models or self.view.request.model
        return f"{type(self).__name__}({self.id}, {model!r}, {self.job_status})"

    @property
    def result(self) -> FitOutcome:
        """All that the fit gave."""
        if self.view.result is None:
            raise FitUnfinishedError(self._unfinished())
        return self.view.result

    @property
    def parameters(self) -> dict[str, float | list[float | None] | None]:
        """The value of each parameter, or one a channel; None where the data do not determine it."""
        return self.result.parameters

    @property
    def intervals(self) -> dict[str, Interval | list[Interval]]:
        """The 95 % interval of each parameter, or one a channel; None where there is none."""
        return self.result.intervals

    @property
    def errors(self) -> dict[str, float | None]:
        """The error under every loss."""
        return self.result.errors

    @property
    def status(self) -> str:
        """How the fit ended: "converged", "undetermined" (so, but some values are free) or "stopped_early"."""
        return self.result.status

    @property
    def undetermined(self) -> list[str]:
        """What the data do not determine: keys, or "key with key" where only the combination is."""
        return self.result.undetermined

    @property
    def certificate(self) -> CertificateView:
        """Whether the fitted material could exist: its largest albedo and where, reciprocity, and a verdict."""
        return self.result.certificate

    @property
    def cost(self) -> CostView:
        """What the fit took."""
        return self.result.cost

    @property
    def material(self) -> "Material":
        """The fitted material; needs brdfcore and torch where the client runs."""
        from brdfcore.models.material import Material

        return Material.from_json(self.result.material)

    def report(self) -> str:
        """The result as plain text."""
        return self.result.report

    def _drawn(self, name: str, kind: str, **asked: Any) -> Call[bytes]:
        given = {key: value for key, value in asked.items() if value is not None}
        return (yield from calls.content("GET", f"{self._path}/{self.id}/plots/{name}.{kind}", params=given))

    def _exported(self, name: str) -> Call[ExportedFile]:
        answer = yield from calls.answered("GET", f"{self._path}/{self.id}/export/{name}")
        difference = float(answer.headers["x-brdf-difference"])
        return ExportedFile(bytes(answer.content), difference, answer.headers["x-brdf-holds"])


class _Table(_Job[TableView]):
    """A table of albedos on the service."""

    _path, _name = "/v1/albedo", "table"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.id}, {self.view.request.material!r}, {self.job_status})"

    @property
    def result(self) -> TableOutcome:
        """What the table is: its axes, its error, whether that meets the tolerance, and what it cost."""
        if self.view.result is None:
            raise JobUnfinishedError(self._unfinished())
        return self.view.result

    def _numbers(self, kind: str) -> Call[bytes]:
        accept = {"npz": "application/x-npz", "json": "application/json"}[kind]
        return (yield from calls.content("GET", f"{self._path}/{self.id}/table", headers={"accept": accept}))


class _Batch:
    """Fits that were submitted together."""

    view: BatchView

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.id}, {dict(self.view.counts)})"

    @property
    def id(self) -> str:
        """The batch's id."""
        return self.view.id

    def _answered(self, method: str, tail: str) -> Call[Self]:
        self.view = yield from calls.read(BatchView, method, f"/v1/batches/{self.id}{tail}")
        return self

    def _finished(self, timeout: float | None, progress: Callable[[BatchView], None] | None) -> Call[Self]:
        begun = time.monotonic()
        while True:
            if progress is not None:
                progress(self.view)
            waited = time.monotonic() - begun
            if self.view.finished:
                return self
            if timeout is not None and waited >= timeout:
                raise WaitError(f"Expected batch {self.id} to finish in the time given, but it runs.")
            yield calls.Pause(min(max(waited / 10, 0.05), 1.0))
            yield from self._answered("GET", "")

    def _rows(self) -> Call[list[BatchRow]]:
        return (yield from calls.read(BatchTable, "GET", f"/v1/batches/{self.id}/table")).rows

    def _csv(self) -> Call[str]:
        path = f"/v1/batches/{self.id}/table"
        return (yield from calls.content("GET", path, headers={"accept": "text/csv"})).decode()

    def _removed(self) -> Call[None]:
        yield from calls.content("DELETE", f"/v1/batches/{self.id}")


class _Waiting(_Job[View]):
    """What waits for the service."""

    def __init__(self, run: Run, view: View) -> None:
        self._run = run
        self.view = view

    def refresh(self) -> Self:
        """The job as it stands now."""
        found: Self = self._run(self._answered("GET", ""))
        return found

    def wait(self, timeout: float | None = None, progress: Tell | None = None) -> Self:
        """The job, succeeded; JobFailedError if it ends otherwise, WaitError after `timeout` s."""
        found: Self = self._run(self._finished(timeout, progress))
        return found

    def cancel(self) -> Self:
        """The job, cancelled."""
        found: Self = self._run(self._answered("POST", "/cancel"))
        return found

    def delete(self) -> None:
        """Remove the job from the service."""
        self._run(self._removed())


class _Awaited(_Job[View]):
    """What is awaited of the service."""

    def __init__(self, run: Start, view: View) -> None:
        self._run = run
        self.view = view

    async def refresh(self) -> Self:
        """The job as it stands now."""
        found: Self = await self._run(self._answered("GET", ""))
        return found

    async def wait(self, timeout: float | None = None, progress: Tell | None = None) -> Self:
        """The job, succeeded; JobFailedError if it ends otherwise, WaitError after `timeout` s."""
        found: Self = await self._run(self._finished(timeout, progress))
        return found

    async def cancel(self) -> Self:
        """The job, cancelled."""
        found: Self = await self._run(self._answered("POST", "/cancel"))
        return found

    async def delete(self) -> None:
        """Remove the job from the service."""
        await self._run(self._removed())


class FitResult(_Fit, _Waiting[FitView]):
    """A fit on the service; all that is its result needs it to have succeeded."""

    def plot(
        self,
        name: str = "lobes",
        kind: str = "svg",
        *,
        scale: str | None = None,
        theta_i_deg: Sequence[float] | None = None,
        channel: str | None = None,
    ) -> bytes:
        """The plot of that name, as the bytes of an SVG or PNG file."""
        image: bytes = self._run(self._drawn(name, kind, scale=scale, theta_i_deg=theta_i_deg, channel=channel))
        return image

    def export(self, format: str) -> ExportedFile:  # noqa: A002 - the name that the library and the service use
        """The fitted material as a file for radiance, mitsuba, brdf_explorer, merl or json."""
        file: ExportedFile = self._run(self._exported(format))
        return file


class AsyncFitResult(_Fit, _Awaited[FitView]):
    """The same, to be awaited."""

    async def plot(
        self,
        name: str = "lobes",
        kind: str = "svg",
        *,
        scale: str | None = None,
        theta_i_deg: Sequence[float] | None = None,
        channel: str | None = None,
    ) -> bytes:
        """The plot of that name, as the bytes of an SVG or PNG file."""
        drawn = self._drawn(name, kind, scale=scale, theta_i_deg=theta_i_deg, channel=channel)
        image: bytes = await self._run(drawn)
        return image

    async def export(self, format: str) -> ExportedFile:  # noqa: A002 - the name that the library and the service use
        """The fitted material as a file for radiance, mitsuba, brdf_explorer, merl or json."""
        file: ExportedFile = await self._run(self._exported(format))
        return file


class BatchResult(_Batch):
    """Fits that were submitted together."""

    def __init__(self, run: Run, view: BatchView) -> None:
        self._run = run
        self.view = view

    def refresh(self) -> Self:
        """The batch as it stands now."""
        found: Self = self._run(self._answered("GET", ""))
        return found

    def wait(self, timeout: float | None = None, progress: Callable[[BatchView], None] | None = None) -> Self:
        """The batch once no fit of it is queued or running, however they ended; WaitError after `timeout` s."""
        found: Self = self._run(self._finished(timeout, progress))
        return found

    def rows(self) -> list[BatchRow]:
        """Its fits as they stand, in the order of datasets, then of models."""
        found: list[BatchRow] = self._run(self._rows())
        return found

    def csv(self) -> str:
        """The same as a CSV file."""
        found: str = self._run(self._csv())
        return found

    def cancel(self) -> Self:
        """The batch, what of it was not finished cancelled."""
        found: Self = self._run(self._answered("POST", "/cancel"))
        return found

    def delete(self) -> None:
        """Remove the batch and its fits from the service."""
        self._run(self._removed())


class AsyncBatchResult(_Batch):
    """The same, to be awaited."""

    def __init__(self, run: Start, view: BatchView) -> None:
        self._run = run
        self.view = view

    async def refresh(self) -> Self:
        """The batch as it stands now."""
        found: Self = await self._run(self._answered("GET", ""))
        return found

    async def wait(self, timeout: float | None = None, progress: Callable[[BatchView], None] | None = None) -> Self:
        """The batch once no fit of it is queued or running, however they ended; WaitError after `timeout` s."""
        found: Self = await self._run(self._finished(timeout, progress))
        return found

    async def rows(self) -> list[BatchRow]:
        """Its fits as they stand, in the order of datasets, then of models."""
        found: list[BatchRow] = await self._run(self._rows())
        return found

    async def csv(self) -> str:
        """The same as a CSV file."""
        found: str = await self._run(self._csv())
        return found

    async def cancel(self) -> Self:
        """The batch, what of it was not finished cancelled."""
        found: Self = await self._run(self._answered("POST", "/cancel"))
        return found

    async def delete(self) -> None:
        """Remove the batch and its fits from the service."""
        await self._run(self._removed())


class TableResult(_Table, _Waiting[TableView]):
    """A table of albedos on the service."""

    def content(self, kind: str = "npz") -> bytes:
        """The table's numbers as the bytes of an npz or JSON file, which brdfcore.AlbedoTable.load reads."""
        numbers: bytes = self._run(self._numbers(kind))
        return numbers


class AsyncTableResult(_Table, _Awaited[TableView]):
    """The same, to be awaited."""

    async def content(self, kind: str = "npz") -> bytes:
        """The table's numbers as the bytes of an npz or JSON file, which brdfcore.AlbedoTable.load reads."""
        numbers: bytes = await self._run(self._numbers(kind))
        return numbers
