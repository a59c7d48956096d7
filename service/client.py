"""A synchronous client of the service; needs httpx2 and pydantic, neither torch nor brdfcore.

with Client("http://127.0.0.1:8000") as client:
    fit = client.fit("garnet_red.brdf", model="lambert + kurt", quantity="brdf")
    print(fit.report())

ClientError
|-- UnreachableError            no answer at all
|-- ProblemError                the service refused, in its own sentence: .status .detail .field .errors
|-- FitFailedError              the fit was accepted and has failed or was cancelled
|-- FitUnfinishedError          a result was asked of a fit that has none yet
`-- WaitError (TimeoutError)    the fit was not finished in the time given
"""

import io
import os
import time
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Any, Self

import httpx2

from .schemas import (
    FINISHED,
    CostView,
    DatasetView,
    FitOutcome,
    FitView,
    Interval,
    JobStatus,
    ModelList,
    ModelView,
    Problem,
)

INLINE_ROWS = 10_000  # more samples than these travel as a file
_WAIT = 30.0  # how long one request waits for its fit; the service caps it at 60 [s]
_COLUMNS = ("wi", "wo", "values", "channels", "sigma", "weight", "cell", "azimuth_observed")


class ClientError(Exception):
    """Base of every error that the client raises on purpose."""


class UnreachableError(ClientError):
    """The service did not answer."""


class ProblemError(ClientError):
    """The service refused; the message is its sentence."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.detail)
        self.status, self.detail, self.field = problem.status, problem.detail, problem.field
        self.errors = problem.errors or []


class FitFailedError(ClientError):
    """The fit has failed or was cancelled; the message says why."""


class FitUnfinishedError(ClientError):
    """The fit has no result yet."""


class WaitError(ClientError, TimeoutError):
    """The fit did not finish in the time that was given to wait."""


class Client:
    """The service at a URL; a context manager. `transport` takes the place of the network, for tests."""

    def __init__(self, url: str, api_key: str | None = None, transport: httpx2.BaseTransport | None = None) -> None:
        headers = {"authorization": f"Bearer {api_key}"} if api_key else {}
        self._http = httpx2.Client(base_url=url, headers=headers, transport=transport, timeout=_WAIT + 60)

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
        return ModelList.model_validate_json(self._send("GET", "/v1/models").content).items

    def upload(
        self,
        path: str | os.PathLike[str],
        *,
        format: str | None = None,  # noqa: A002 - as in brdfcore.read
        quantity: str | None = None,
        angle_unit: str | None = None,
    ) -> DatasetView:
        """The dataset made of a measured file, which is streamed from the disk."""
        declared = {"format": format, "quantity": quantity, "angle_unit": angle_unit}
        with open(path, "rb") as file:
            return self._upload(file, declared)

    def fit(
        self,
        data: "str | os.PathLike[str] | DatasetView | Mapping[str, Any] | Any",
        *,
        model: str,
        loss: str = "cosine",
        optimizer: str = "auto",
        fixed: Mapping[str, float | Sequence[float]] | None = None,
        gray: Sequence[str] = (),
        per_channel: Sequence[str] = (),
        seed: int = 0,
        format: str | None = None,  # noqa: A002 - the name that the library and the service use
        quantity: str | None = None,
        angle_unit: str | None = None,
        wait: bool = True,
        timeout: float | None = None,
    ) -> "FitResult":
        """The fit of a model to a measured file, a dataset, arrays by name, or an object like brdfcore.Samples.

        format, quantity and angle_unit declare what data do not say. With wait=True the fit is finished on return;
        raises FitFailedError, and WaitError after `timeout` s. With wait=False it may still run: see FitResult.wait.
        """
        body: dict[str, Any] = {"model": model, "loss": loss, "optimizer": optimizer, "seed": seed}
        body |= {"fixed": _plain(dict(fixed or {})), "gray": list(gray), "per_channel": list(per_channel)}
        if isinstance(data, DatasetView):
            body["dataset"] = data.id
        elif isinstance(data, str | os.PathLike):
            body["dataset"] = self.upload(data, format=format, quantity=quantity, angle_unit=angle_unit).id
        else:
            columns = _columns(data, quantity)
            if len(columns["values"]) > INLINE_ROWS:
                body["dataset"] = self._upload(_npz(columns), {"angle_unit": "degrees"}).id
            else:
                body["samples"] = columns
        begun = time.monotonic()
        seconds = int(_WAIT if timeout is None else min(timeout, _WAIT)) if wait else 0
        answer = self._send("POST", "/v1/fits", json=body, headers={"prefer": f"wait={seconds}"})
        result = FitResult(self, FitView.model_validate_json(answer.content))
        left = None if timeout is None else max(0.0, timeout - (time.monotonic() - begun))
        return result.wait(left) if wait else result

    def get(self, fit_id: str) -> "FitResult":
        """The fit of that id as it stands."""
        return FitResult(self, FitView.model_validate_json(self._send("GET", f"/v1/fits/{fit_id}").content))

    def _upload(self, content: Any, declared: Mapping[str, str | None]) -> DatasetView:
        given = {name: value for name, value in declared.items() if value is not None}
        headers = {"content-type": "application/octet-stream"}
        answer = self._send("POST", "/v1/datasets", content=content, params=given, headers=headers)
        return DatasetView.model_validate_json(answer.content)

    def _send(self, method: str, path: str, **what: Any) -> httpx2.Response:
        try:
            answer = self._http.request(method, path, **what)
        except httpx2.TransportError as error:
            raise UnreachableError(
                f"Expected a service at {self._http.base_url}, got {type(error).__name__}: {error}. Is it running?"
            ) from error
        if answer.is_success:
            return answer
        if answer.headers.get("content-type", "").startswith("application/problem+json"):
            raise ProblemError(Problem.model_validate_json(answer.content))
        detail = f"Expected an answer of this service at {answer.url}, got status {answer.status_code}. Check the URL."
        raise ProblemError(Problem(title=answer.reason_phrase, status=answer.status_code, detail=detail))


class FitResult:
    """A fit on the service. `job_status` says how it stands; all that is its result needs it to have succeeded."""

    def __init__(self, client: Client, view: FitView) -> None:
        self._client = client
        self.view = view

    def __repr__(self) -> str:
        return f"FitResult({self.id}, {self.view.request.model!r}, {self.job_status})"

    @property
    def id(self) -> str:
        """The fit's id."""
        return self.view.id

    @property
    def job_status(self) -> JobStatus:
        """queued, running, succeeded, failed or cancelled, as of the last answer."""
        return self.view.status

    def refresh(self) -> Self:
        """The fit as it stands now."""
        self.view = self._client.get(self.id).view
        return self

    def wait(self, timeout: float | None = None) -> Self:
        """The fit, succeeded; FitFailedError if it ends otherwise, WaitError after `timeout` s."""
        begun = time.monotonic()
        while self.job_status not in FINISHED:
            waited = time.monotonic() - begun
            if timeout is not None and waited >= timeout:
                raise WaitError(f"Expected fit {self.id} to finish in the time given, but it is {self.job_status}.")
            time.sleep(min(max(waited / 10, 0.05), 1.0))
            self.refresh()
        if self.job_status != "succeeded":
            raise FitFailedError(self.view.error or f"The fit {self.id} was cancelled.")
        return self

    def cancel(self) -> Self:
        """The fit, cancelled."""
        answer = self._client._send("POST", f"/v1/fits/{self.id}/cancel")
        self.view = FitView.model_validate_json(answer.content)
        return self

    def delete(self) -> None:
        """Remove the fit from the service."""
        self._client._send("DELETE", f"/v1/fits/{self.id}")

    @property
    def result(self) -> FitOutcome:
        """All that the fit gave."""
        if self.view.result is None:
            raise FitUnfinishedError(
                f"Expected fit {self.id} to have succeeded, but it is {self.job_status}. Call wait()."
            )
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
        return self._client._send("GET", f"/v1/fits/{self.id}/plots/{name}.{kind}", params=asked).content


def _columns(data: Any, quantity: str | None) -> dict[str, Any]:
    """Inline samples as the wire wants them, of a mapping or of an object with the attributes of brdfcore.Samples."""
    if isinstance(data, Mapping):
        found = {name: _plain(value) for name, value in data.items()}
        if quantity is not None:
            found["quantity"] = quantity
    else:
        found = {name: _plain(getattr(data, name, None)) for name in _COLUMNS}
        found["quantity"] = "brdf"  # whatever was declared, Samples keeps the BRDF
    for name in ("values", "sigma"):
        rows = found.get(name)
        if rows and not isinstance(rows[0], list):
            found[name] = [[value] for value in rows]
    if "values" not in found:
        raise ClientError("Expected data to hold values, got none. Give values, quantity, and wi and wo or the angles.")
    return {name: value for name, value in found.items() if value is not None}


def _plain(value: Any) -> Any:
    """Lists and numbers for arrays, tensors and tuples."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _npz(columns: Mapping[str, Any]) -> bytes:
    """The columns as the bytes of a NumPy archive that brdfcore reads."""
    import numpy as np  # only who sends many samples needs it

    arrays = {name.removesuffix("_deg"): np.asarray(value) for name, value in columns.items()}
    if "azimuth_observed" in columns:
        arrays["azimuth_observed"] = np.asarray(str(columns["azimuth_observed"]).lower())
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **arrays)
    return out.getvalue()
