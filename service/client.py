"""A synchronous client of the service; needs httpx2 and pydantic, neither torch nor brdfcore.

with Client("http://127.0.0.1:8000") as client:
    fit = client.fit("garnet_red.brdf", model="lambert + kurt", quantity="brdf")
    print(fit.report())
    print(client.albedo("lambert + kurt", [0, 60, 89]).values)
"""

import io
import os
import time
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx2
from pydantic import BaseModel

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
from .client_results import ExportedFile, FitResult, JobResult, Send, TableResult
from .schemas import (
    AlbedoView,
    DatasetView,
    EvaluationView,
    FitView,
    ModelList,
    ModelView,
    Problem,
    TableView,
)

__all__ = [
    "Client",
    "ClientError",
    "ExportedFile",
    "FitFailedError",
    "FitResult",
    "FitUnfinishedError",
    "JobFailedError",
    "JobUnfinishedError",
    "ProblemError",
    "TableResult",
    "UnreachableError",
    "WaitError",
]

INLINE_ROWS = 10_000  # more samples than these travel as a file
_WAIT = 30.0  # how long one request waits for its fit; the service caps it at 60 [s]
_Result = TypeVar("_Result", bound=JobResult[Any])
_COLUMNS = ("wi", "wo", "values", "channels", "sigma", "weight", "cell", "azimuth_observed")


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
        bounds: Mapping[str, Sequence[float]] | None = None,
        starts: Sequence[Mapping[str, float | Sequence[float]]] = (),
        robust: str | None = None,
        robust_scale: float | None = None,
        max_theta_deg: float | None = None,
        conserve_energy: bool = False,
        format: str | None = None,  # noqa: A002 - the name that the library and the service use
        quantity: str | None = None,
        angle_unit: str | None = None,
        wait: bool = True,
        timeout: float | None = None,
    ) -> FitResult:
        """The fit of a model to a measured file, a dataset, arrays by name, or an object like brdfcore.Samples.

        format, quantity and angle_unit declare what data do not say. With wait=True the fit is finished on return;
        raises FitFailedError, and WaitError after `timeout` s. With wait=False it may still run: see FitResult.wait.
        """
        body: dict[str, Any] = {"model": model, "loss": loss, "optimizer": optimizer, "seed": seed}
        body |= {"fixed": _plain(dict(fixed or {})), "gray": list(gray), "per_channel": list(per_channel)}
        body |= {"bounds": _plain(dict(bounds or {})), "starts": [_plain(dict(start)) for start in starts]}
        body |= {"robust": robust, "robust_scale": robust_scale, "max_theta_deg": max_theta_deg}
        body["conserve_energy"] = conserve_energy
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
        return self._submitted("/v1/fits", body, FitResult, FitView, wait, timeout)

    def get(self, fit_id: str) -> FitResult:
        """The fit of that id as it stands."""
        return FitResult(self._send, FitView.model_validate_json(self._send("GET", f"/v1/fits/{fit_id}").content))

    def evaluate(
        self,
        material: "str | Mapping[str, Any] | Any",
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
        body = {name: _plain(value) for name, value in given.items() if value is not None}
        answer = self._send("POST", "/v1/evaluate", json=body | {"material": _material(material)})
        return EvaluationView.model_validate_json(answer.content)

    def albedo(
        self,
        material: "str | Mapping[str, Any] | Any",
        theta_deg: Any,
        phi_deg: float = 0.0,
        tolerance: float = 1e-6,
    ) -> AlbedoView:
        """The directional albedos of a material, given as in `evaluate`, for polar angles [degrees]."""
        body = {"material": _material(material), "theta_deg": _plain(theta_deg), "phi_deg": phi_deg}
        answer = self._send("POST", "/v1/albedo", json=body | {"tolerance": tolerance})
        return AlbedoView.model_validate_json(answer.content)

    def albedo_table(
        self,
        material: "str | Mapping[str, Any] | Any",
        axes: "Mapping[str, tuple[float, float] | None] | None" = None,
        tolerance: float = 1e-4,
        *,
        wait: bool = True,
        timeout: float | None = None,
    ) -> TableResult:
        """The table of albedos of a material, given as in `evaluate`, over axes such as {"theta_deg": (0, 85)}.

        With wait=True it is finished on return; raises JobFailedError, and WaitError after `timeout` s.
        """
        body = {"material": _material(material), "axes": _plain(dict(axes or {})), "tolerance": tolerance}
        return self._submitted("/v1/albedo", body, TableResult, TableView, wait, timeout)

    def get_table(self, table_id: str) -> TableResult:
        """The table of that id as it stands."""
        return TableResult(
            self._send, TableView.model_validate_json(self._send("GET", f"/v1/albedo/{table_id}").content)
        )

    def _submitted(
        self,
        path: str,
        body: Mapping[str, Any],
        made: Callable[[Send, Any], _Result],
        view: type[BaseModel],
        wait: bool,
        timeout: float | None,
    ) -> _Result:
        begun = time.monotonic()
        seconds = int(_WAIT if timeout is None else min(timeout, _WAIT)) if wait else 0
        answer = self._send("POST", path, json=body, headers={"prefer": f"wait={seconds}"})
        result = made(self._send, view.model_validate_json(answer.content))
        left = None if timeout is None else max(0.0, timeout - (time.monotonic() - begun))
        return result.wait(left) if wait else result

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


def _material(given: Any) -> Any:
    """A material as the wire wants it."""
    return given.to_json() if hasattr(given, "to_json") else _plain(given)


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
