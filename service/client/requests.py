"""Every request of the clients, as calls; what may be asked, by keyword."""

import os
import time
import uuid
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypedDict, TypeVar, Unpack

from ..schemas import (
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
    JobView,
    ModelList,
    ModelView,
    RenderView,
    TableView,
)
from .calls import Call, Tell, content, finished, read
from .data import material_of, placed, plain, uploaded
from .errors import FitFailedError, JobFailedError

LONGEST = 30.0  # how long one request waits for its job; the service caps it at 60 [s]
_Job = TypeVar("_Job", bound=JobView)
Material = Any  # a text, a preset's name, its JSON, or an object like brdfcore.Material
Scene = Any  # the name of a shipped one, its JSON, or an object like brdfcore.render.Scene
File = str | os.PathLike[str]
Axes = Mapping[str, tuple[float, float] | None]


class Declared(TypedDict, total=False):
    """What a measured file does not say of itself, as in brdfcore.read."""

    format: str | None
    quantity: str | None
    angle_unit: str | None
    columns: str | None
    rgb: bool


class FitOptions(Declared, total=False):
    """What may be asked of a fit, as fields of POST /v1/fits, and what may be declared of its file."""

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


class RenderOptions(TypedDict, total=False):
    """What may be asked of an image, as fields of POST /v1/renders; what is absent the scene says."""

    tolerance: float
    samples: int
    noise: float
    seed: int


class Directions(TypedDict, total=False):
    """Pairs of directions: unit vectors, or four angles [degrees]; lists, arrays or tensors."""

    wi: Any
    wo: Any
    theta_i_deg: Any
    phi_i_deg: Any
    theta_o_deg: Any
    phi_o_deg: Any


def models() -> Call[list[ModelView]]:
    """Every model."""
    return (yield from read(ModelList, "GET", "/v1/models")).items


def formats() -> Call[list[FormatView]]:
    """Every format of measured files."""
    return (yield from read(FormatList, "GET", "/v1/formats")).items


def upload(path: File, declared: Declared) -> Call[DatasetView]:
    """The dataset made of a file."""
    return uploaded(path, declared)


def fit(
    data: Any,
    model: str | None,
    models: Sequence[str] | None,
    options: FitOptions,
    *,
    wait: bool,
    timeout: float | None = None,
    progress: Tell | None = None,
) -> Call[FitView]:
    """The fit, finished where that is to be waited for."""
    begun = time.monotonic()
    declared, asked = _parted(options)
    named = {"model": model, "models": models and list(models)}
    body = asked | {name: value for name, value in named.items() if value is not None}
    body |= yield from placed(data, declared)
    at_once = wait and progress is None  # who wants to hear of progress asks for it instead of waiting for one answer
    view = yield from _submitted("/v1/fits", body, FitView, at_once, timeout)
    if not wait:
        return view
    return (yield from finished("/v1/fits", view, "fit", FitFailedError, _left(begun, timeout), progress))


def get_fit(fit_id: str) -> Call[FitView]:
    """The fit of that id."""
    return read(FitView, "GET", f"/v1/fits/{fit_id}")


def recent(limit: int, status: JobStatus | None) -> Call[list[FitSummary]]:
    """The newest fits."""
    asked = {"limit": limit} | ({"status": status} if status else {})
    return (yield from read(FitPage, "GET", "/v1/fits", params=asked)).items


def batch(data: Iterable[Any], models: Sequence[str], options: FitOptions) -> Call[BatchView]:
    """A new batch, its files uploaded first."""
    declared, body = _parted(options)
    body |= {"models": list(models), "datasets": []}
    for one in data:
        dataset = one if isinstance(one, DatasetView) else (yield from uploaded(one, declared))
        body["datasets"].append(dataset.id)
    return (yield from read(BatchView, "POST", "/v1/batches", json=body, headers=_promised()))


def get_batch(batch_id: str) -> Call[BatchView]:
    """The batch of that id."""
    return read(BatchView, "GET", f"/v1/batches/{batch_id}")


def table(
    material: Material, axes: Axes | None, tolerance: float, *, wait: bool, timeout: float | None
) -> Call[TableView]:
    """The table of albedos, finished where that is to be waited for."""
    begun = time.monotonic()
    body = {"material": material_of(material), "axes": plain(axes or {}), "tolerance": tolerance}
    view = yield from _submitted("/v1/albedo", body, TableView, wait, timeout)
    if not wait:
        return view
    return (yield from finished("/v1/albedo", view, "table", JobFailedError, _left(begun, timeout), None))


def get_table(table_id: str) -> Call[TableView]:
    """The table of that id."""
    return read(TableView, "GET", f"/v1/albedo/{table_id}")


def evaluation(material: Material, **directions: Unpack[Directions]) -> Call[EvaluationView]:
    """A material's BRDF, density and weight."""
    given = {name: plain(value) for name, value in directions.items() if value is not None}
    return read(EvaluationView, "POST", "/v1/evaluate", json={"material": material_of(material), **given})


def albedo(
    material: Material, theta_deg: Any, phi_deg: float, tolerance: float, *, certificate: bool
) -> Call[AlbedoView]:
    """A material's albedos."""
    body = {"theta_deg": plain(theta_deg), "phi_deg": phi_deg, "tolerance": tolerance, "certificate": certificate}
    return read(AlbedoView, "POST", "/v1/albedo", json={"material": material_of(material), **body})


def sphere(material: Material, channels: Sequence[str] | None, size: int) -> Call[bytes]:
    """A lit sphere of a material."""
    body = {"material": material_of(material), "channels": plain(channels), "size": size}
    return content("POST", "/v1/sphere", json=body)


def render(
    scene: Scene, options: RenderOptions, *, wait: bool, timeout: float | None, progress: Tell | None
) -> Call[RenderView]:
    """The image of a scene, finished where that is to be waited for."""
    begun = time.monotonic()
    body = {"scene": material_of(scene), **options}
    view = yield from _submitted("/v1/renders", body, RenderView, wait and progress is None, timeout)
    if not wait:
        return view
    return (yield from finished("/v1/renders", view, "render", JobFailedError, _left(begun, timeout), progress))


def get_render(render_id: str) -> Call[RenderView]:
    """The render of that id."""
    return read(RenderView, "GET", f"/v1/renders/{render_id}")


def _parted(options: FitOptions) -> tuple[Declared, dict[str, Any]]:
    """What is declared of a file, and what is asked of the fit as the wire wants it."""
    declared: Any = {name: value for name, value in options.items() if name in Declared.__annotations__}
    return declared, {name: plain(value) for name, value in options.items() if name not in declared}


def _submitted(path: str, body: Mapping[str, Any], view: type[_Job], wait: bool, timeout: float | None) -> Call[_Job]:
    """A new job, as it stands after one request that waits for it where that is wanted."""
    seconds = int(LONGEST if timeout is None else min(timeout, LONGEST)) if wait else 0
    return (yield from read(view, "POST", path, json=body, headers={"prefer": f"wait={seconds}", **_promised()}))


def _promised() -> dict[str, str]:
    """The header by which the service knows a submission that is sent again."""
    return {"idempotency-key": uuid.uuid4().hex}


def _left(begun: float, timeout: float | None) -> float | None:
    """What is left of the time."""
    return None if timeout is None else max(0.0, timeout - (time.monotonic() - begun))
