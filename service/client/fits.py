"""Fits on the service, as the clients hand them out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from ..schemas import CertificateView, ComparisonView, CostView, FitOutcome, FitView, Interval, ProgressView
from .calls import Call, answered, content
from .errors import FitFailedError, FitUnfinishedError
from .jobs import Awaited, Job, Waiting

if TYPE_CHECKING:
    from brdfcore.models.material import Material


@dataclass(frozen=True)
class ExportedFile:
    """A fitted material as another program's file, what it holds, and how far from the material that is."""

    content: bytes
    difference: float  # relative RMS difference of f cos theta_i [1]
    holds: str


class PlotOptions(TypedDict, total=False):
    """What may be asked of a plot; each plot takes those that it knows."""

    scale: str | None
    theta_i_deg: Sequence[float] | None
    phi_deg: float | None
    channel: str | None
    rank: int  # of the model, where several were compared; 1 is the best


class _Fit(Job[FitView]):
    """A fit on the service; all that is its result needs it to have succeeded."""

    _path, _name, _failed = "/v1/fits", "fit", FitFailedError

    def __repr__(self) -> str:
        model = self.view.request.models or self.view.request.model
        return f"{type(self).__name__}({self.id}, {model!r}, {self.job_status})"

    @property
    def result(self) -> FitOutcome:
        """All that the fit gave; of several models, the best one's."""
        if self.view.result is None:
            raise FitUnfinishedError(self._unfinished())
        return self.view.result

    @property
    def comparison(self) -> ComparisonView | None:
        """How several models did, the best first; None where one was fitted."""
        return getattr(self.result, "comparison", None)

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

    def _drawn(self, name: str, kind: str, asked: PlotOptions) -> Call[bytes]:
        given: Any = {key: value for key, value in asked.items() if value is not None}
        return (yield from content("GET", f"{self._path}/{self.id}/plots/{name}.{kind}", params=given))

    def _exported(self, name: str, rank: int) -> Call[ExportedFile]:
        answer = yield from answered("GET", f"{self._path}/{self.id}/export/{name}", params={"rank": rank})
        difference = float(answer.headers["x-brdf-difference"])
        return ExportedFile(bytes(answer.content), difference, answer.headers["x-brdf-holds"])


class FitResult(_Fit, Waiting[FitView, ProgressView]):
    """A fit on the service; all that is its result needs it to have succeeded."""

    def plot(self, name: str = "lobes", kind: str = "svg", **asked: Unpack[PlotOptions]) -> bytes:
        """The plot of that name (lobes, albedo or residuals), as the bytes of an SVG or PNG file."""
        return self._run(self._drawn(name, kind, asked))

    def export(self, format: str, *, rank: int = 1) -> ExportedFile:  # noqa: A002 - the name that the library uses
        """The fitted material as a file for radiance, mitsuba, brdf_explorer, merl or json; of several, the rank's."""
        return self._run(self._exported(format, rank))


class AsyncFitResult(_Fit, Awaited[FitView, ProgressView]):
    """The same, to be awaited."""

    async def plot(self, name: str = "lobes", kind: str = "svg", **asked: Unpack[PlotOptions]) -> bytes:
        """The plot of that name (lobes, albedo or residuals), as the bytes of an SVG or PNG file."""
        return await self._run(self._drawn(name, kind, asked))

    async def export(self, format: str, *, rank: int = 1) -> ExportedFile:  # noqa: A002 - the name that the library uses
        """The fitted material as a file for radiance, mitsuba, brdf_explorer, merl or json; of several, the rank's."""
        return await self._run(self._exported(format, rank))
