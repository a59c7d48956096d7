"""Jobs on the service, as the client hands them out: fits and tables of albedos."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, Self, TypeVar

import httpx2

from .client_errors import FitFailedError, FitUnfinishedError, JobFailedError, JobUnfinishedError, WaitError
from .schemas import (
    FINISHED,
    CertificateView,
    CostView,
    FitOutcome,
    FitView,
    Interval,
    JobStatus,
    JobView,
    TableOutcome,
    TableView,
)


@dataclass(frozen=True)
class ExportedFile:
    """A fitted material as another program's file, what it holds, and how far from the material that is."""

    content: bytes
    difference: float  # relative RMS difference of f cos theta_i [1]
    holds: str


Send = Callable[..., httpx2.Response]  # what asks the service: method, path, and what httpx2 takes
View = TypeVar("View", bound=JobView)


class JobResult(Generic[View]):
    """A job on the service. `job_status` says how it stands."""

    _path: ClassVar[str]
    _name: ClassVar[str]
    _failed: ClassVar[type[JobFailedError]] = JobFailedError
    _model: type[View]

    def __init__(self, send: Send, view: View) -> None:
        self._send = send
        self.view = view

    @property
    def id(self) -> str:
        """The job's id."""
        return self.view.id

    @property
    def job_status(self) -> JobStatus:
        """queued, running, succeeded, failed or cancelled, as of the last answer."""
        return self.view.status

    def refresh(self) -> Self:
        """The job as it stands now."""
        return self._answered("GET", "")

    def wait(self, timeout: float | None = None) -> Self:
        """The job, succeeded; JobFailedError if it ends otherwise, WaitError after `timeout` s."""
        begun = time.monotonic()
        while self.job_status not in FINISHED:
            waited = time.monotonic() - begun
            if timeout is not None and waited >= timeout:
                raise WaitError(
                    f"Expected {self._name} {self.id} to finish in the time given, but it is {self.job_status}."
                )
            time.sleep(min(max(waited / 10, 0.05), 1.0))
            self.refresh()
        if self.job_status != "succeeded":
            raise self._failed(self.view.error or f"The {self._name} {self.id} was cancelled.")
        return self

    def cancel(self) -> Self:
        """The job, cancelled."""
        return self._answered("POST", "/cancel")

    def delete(self) -> None:
        """Remove the job from the service."""
        self._send("DELETE", f"{self._path}/{self.id}")

    def _answered(self, method: str, tail: str) -> Self:
        answer = self._send(method, f"{self._path}/{self.id}{tail}")
        self.view = self._model.model_validate_json(answer.content)
        return self

    def _unfinished(self) -> str:
        return f"Expected {self._name} {self.id} to have succeeded, but it is {self.job_status}. Call wait()."


class TableResult(JobResult[TableView]):
    """A table of albedos on the service."""

    _path, _name, _model = "/v1/albedo", "table", TableView

    def __repr__(self) -> str:
        return f"TableResult({self.id}, {self.view.request.material!r}, {self.job_status})"

    @property
    def result(self) -> TableOutcome:
        """What the table is: its axes, its error, whether that meets the tolerance, and what it cost."""
        if self.view.result is None:
            raise JobUnfinishedError(self._unfinished())
        return self.view.result

    def content(self, kind: str = "npz") -> bytes:
        """The table's numbers as the bytes of an npz or JSON file, which brdfcore.AlbedoTable.load reads."""
        accept = {"npz": "application/x-npz", "json": "application/json"}[kind]
        return self._send("GET", f"/v1/albedo/{self.id}/table", headers={"accept": accept}).content


class FitResult(JobResult[FitView]):
    """A fit on the service; all that is its result needs it to have succeeded."""

    _path, _name, _model, _failed = "/v1/fits", "fit", FitView, FitFailedError

    def __repr__(self) -> str:
        return f"FitResult({self.id}, {self.view.request.model!r}, {self.job_status})"

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
        """How the fit ended, "converged" or "stopped_early"."""
        return self.result.status

    @property
    def undetermined(self) -> list[str]:
        """The parameters that the data do not determine."""
        return self.result.undetermined

    @property
    def certificate(self) -> CertificateView:
        """Whether the fitted material could exist: its largest albedo and where, reciprocity, and a verdict."""
        return self.result.certificate

    @property
    def cost(self) -> CostView:
        """What the fit took."""
        return self.result.cost

    def report(self) -> str:
        """The result as plain text."""
        return self.result.report

    def plot(
        self,
        name: str = "lobes",
        kind: str = "svg",
        *,
        scale: str = "linear",
        theta_i_deg: Sequence[float] = (),
        channel: str | None = None,
    ) -> bytes:
        """The plot of that name, as the bytes of an SVG or PNG file."""
        asked = {"scale": scale, "theta_i_deg": list(theta_i_deg)} | ({"channel": channel} if channel else {})
        return self._send("GET", f"/v1/fits/{self.id}/plots/{name}.{kind}", params=asked).content

    def export(self, format: str) -> ExportedFile:  # noqa: A002 - the name that the library and the service use
        """The fitted material as a file for radiance, mitsuba, brdf_explorer, merl or json."""
        answer = self._send("GET", f"/v1/fits/{self.id}/export/{format}")
        return ExportedFile(answer.content, float(answer.headers["x-brdf-difference"]), answer.headers["x-brdf-holds"])
