"""What a client asks, as steps that know nothing of the network: both clients take them, one waiting, one awaiting.

A call is a generator. It yields what to ask, or how long to pause, is sent the answer, and returns its result.
"""

import io
import os
import time
import uuid
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pydantic import BaseModel

from .client_errors import ClientError, JobFailedError, WaitError
from .schemas import FINISHED, DatasetView, JobView, ProgressView

INLINE_ROWS = 10_000  # more samples than these travel as a file
LONGEST = 30.0  # how long one request waits for its job; the service caps it at 60 [s]
_COLUMNS = ("wi", "wo", "values", "channels", "sigma", "weight", "cell", "azimuth_observed")


@dataclass(frozen=True)
class Ask:
    """A request; all of them can be sent twice without doing anything twice."""

    method: str
    path: str
    what: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Pause:
    """So many seconds in which nothing is asked."""

    seconds: float


_T = TypeVar("_T")
_View = TypeVar("_View", bound=BaseModel)
_Job = TypeVar("_Job", bound=JobView)
Call = Generator[Ask | Pause, Any, _T]
Tell = Callable[[ProgressView], None]


def read(view: type[_View], method: str, path: str, **what: Any) -> Call[_View]:
    """What the service answers, as a view."""
    answer = yield Ask(method, path, what)
    return view.model_validate_json(answer.content)


def answered(method: str, path: str, **what: Any) -> Call[Any]:
    """The answer itself, where its headers count."""
    return (yield Ask(method, path, what))


def content(method: str, path: str, **what: Any) -> Call[bytes]:
    """The bytes that the service answers."""
    answer = yield Ask(method, path, what)
    return bytes(answer.content)


def submitted(path: str, body: Mapping[str, Any], view: type[_Job], wait: bool, timeout: float | None) -> Call[_Job]:
    """A new job, as it stands after one request that waits for it where that is wanted."""
    seconds = int(LONGEST if timeout is None else min(timeout, LONGEST)) if wait else 0
    headers = {"prefer": f"wait={seconds}", "idempotency-key": uuid.uuid4().hex}
    return (yield from read(view, "POST", path, json=body, headers=headers))


def finished(
    path: str, job: _Job, name: str, failed: type[JobFailedError], timeout: float | None, progress: Tell | None
) -> Call[_Job]:
    """The job, succeeded; raises `failed` if it ends otherwise, WaitError after `timeout` s."""
    begun, told = time.monotonic(), None
    while True:
        if progress is not None and job.progress is not None and job.progress != told:
            told = job.progress
            progress(told)
        if job.status in FINISHED:
            break
        waited = time.monotonic() - begun
        if timeout is not None and waited >= timeout:
            raise WaitError(f"Expected {name} {job.id} to finish in the time given, but it is {job.status}.")
        yield Pause(min(max(waited / 10, 0.05), 1.0))
        job = yield from read(type(job), "GET", f"{path}/{job.id}")
    if job.status != "succeeded":
        raise failed(job.error or f"The {name} {job.id} was cancelled.")
    return job


def fit_body(data: Any, given: Mapping[str, Any], declared: Mapping[str, Any]) -> Call[dict[str, Any]]:
    """The body of POST /v1/fits for data of any kind; a file, or what is as large as one, is uploaded first."""
    body = {name: plain(value) for name, value in given.items()}
    if isinstance(data, DatasetView):
        return body | {"dataset": data.id}
    if isinstance(data, str | os.PathLike):
        dataset = yield from uploaded(data, declared)
        return body | {"dataset": dataset.id}
    columns = _columns(data, declared.get("quantity"))
    if len(columns["values"]) <= INLINE_ROWS:
        return body | {"samples": columns}
    dataset = yield from _dataset(_npz(columns), {"angle_unit": "degrees"})
    return body | {"dataset": dataset.id}


def uploaded(path: str | os.PathLike[str], declared: Mapping[str, Any]) -> Call[DatasetView]:
    """The dataset made of a file, which is streamed from the disk."""
    with open(path, "rb") as file:
        return (yield from _dataset(file, declared))


def _dataset(file: Any, declared: Mapping[str, Any]) -> Call[DatasetView]:
    given = {name: value for name, value in declared.items() if value is not None}
    headers = {"content-type": "application/octet-stream"}
    return (yield from read(DatasetView, "POST", "/v1/datasets", content=file, params=given, headers=headers))


def material_of(given: Any) -> Any:
    """A material as the wire wants it."""
    return given.to_json() if hasattr(given, "to_json") else plain(given)


def _columns(data: Any, quantity: str | None) -> dict[str, Any]:
    """Inline samples as the wire wants them, of a mapping or of an object with the attributes of brdfcore.Samples."""
    if isinstance(data, Mapping):
        found = {name: plain(value) for name, value in data.items()}
        if quantity is not None:
            found["quantity"] = quantity
    else:
        found = {name: plain(getattr(data, name, None)) for name in _COLUMNS}
        found["quantity"] = "brdf"  # whatever was declared, Samples keeps the BRDF
    for name in ("values", "sigma"):
        rows = found.get(name)
        if rows and not isinstance(rows[0], list):
            found[name] = [[value] for value in rows]
    if "values" not in found:
        raise ClientError("Expected data to hold values, got none. Give values, quantity, and wi and wo or the angles.")
    return {name: value for name, value in found.items() if value is not None}


def plain(value: Any) -> Any:
    """Lists and numbers for arrays, tensors and tuples."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
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
