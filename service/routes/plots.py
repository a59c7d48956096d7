"""Plots of a finished fit, as SVG or PNG by the extension."""

import asyncio
import hashlib
from typing import TYPE_CHECKING, Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

import brdfcore as bc
from brdfcore import plots
from brdfcore.errors import unknown_name

from ..errors import responses
from ..schemas import FitOutcome, FitRequest
from ..state import State, state
from ._http import require_accepted, unchanged
from ._jobs import Ranked, absent, found, outcome_of, result_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

router = APIRouter(prefix="/v1/fits/{fit_id}/plots", tags=["plots"])

Kind = Literal["svg", "png"]
_MEDIA_TYPE: dict[Kind, str] = {"svg": "image/svg+xml", "png": "image/png"}
Angle = Annotated[float, Field(ge=0, lt=90)]


class Lobes(Ranked):
    """What a plot of lobes shows."""

    scale: Literal["linear", "cube_root", "log"] = Field("linear", description="of the radius")
    theta_i_deg: list[Angle] = Field([], max_length=12, description="angles of incidence; the data's, if none")
    channel: str | None = Field(None, description="which is drawn; the brightest, if none")


class Albedo(Ranked):
    """What a plot of the albedo shows."""

    phi_deg: float = Field(0.0, description="azimuth from which the sample is seen [degrees]")
    channel: str | None = Field(None, description="which is drawn; the brightest, if none")


class Residuals(Ranked):
    """What a plot of residuals shows."""

    channel: str | None = Field(None, description="which is drawn; the brightest, if none")


Asked = Lobes | Albedo | Residuals


@router.get("/lobes.svg", response_class=Response, responses=responses(404, 406, 409, 422))
async def lobes_svg(request: Request, fit_id: str, asked: Annotated[Lobes, Query()]) -> Response:
    """The lobes in the plane of incidence and the measured points over them, as SVG."""
    return await _plot(request, fit_id, asked, "svg")


@router.get("/lobes.png", response_class=Response, responses=responses(404, 406, 409, 422))
async def lobes_png(request: Request, fit_id: str, asked: Annotated[Lobes, Query()]) -> Response:
    """The lobes in the plane of incidence and the measured points over them, as PNG."""
    return await _plot(request, fit_id, asked, "png")


@router.get("/albedo.svg", response_class=Response, responses=responses(404, 406, 409, 422))
async def albedo_svg(request: Request, fit_id: str, asked: Annotated[Albedo, Query()]) -> Response:
    """The directional albedo of the fitted material, marked where it exceeds 1, as SVG."""
    return await _plot(request, fit_id, asked, "svg")


@router.get("/albedo.png", response_class=Response, responses=responses(404, 406, 409, 422))
async def albedo_png(request: Request, fit_id: str, asked: Annotated[Albedo, Query()]) -> Response:
    """The directional albedo of the fitted material, marked where it exceeds 1, as PNG."""
    return await _plot(request, fit_id, asked, "png")


@router.get("/residuals.svg", response_class=Response, responses=responses(404, 406, 409, 422))
async def residuals_svg(request: Request, fit_id: str, asked: Annotated[Residuals, Query()]) -> Response:
    """What the fit leaves unexplained, against theta_o for each incidence and against theta_h, as SVG."""
    return await _plot(request, fit_id, asked, "svg")


@router.get("/residuals.png", response_class=Response, responses=responses(404, 406, 409, 422))
async def residuals_png(request: Request, fit_id: str, asked: Annotated[Residuals, Query()]) -> Response:
    """What the fit leaves unexplained, against theta_o for each incidence and against theta_h, as PNG."""
    return await _plot(request, fit_id, asked, "png")


async def _plot(request: Request, fit_id: str, asked: Asked, kind: Kind) -> Response:
    require_accepted(request, _MEDIA_TYPE[kind])
    service = state(request)
    job = found(service, "fit", fit_id)
    result = result_of(job)
    shown = f"{bc.__version__} {job.id} {job.finished} {kind} {type(asked).__name__} {asked.model_dump_json()}"
    tag = f'W/"{hashlib.sha256(shown.encode()).hexdigest()[:32]}"'
    headers = {"etag": tag, "cache-control": "private, no-cache"}
    if unchanged(request, tag):
        return Response(status_code=304, headers=headers)
    body = service.store.body(fit_id)
    if body is None:
        raise absent("fit", fit_id)  # removed just now
    loop = asyncio.get_running_loop()
    image = await loop.run_in_executor(service.aside, _drawn, service, body, result, asked, kind)
    return Response(image, headers=headers, media_type=_MEDIA_TYPE[kind])


def _drawn(service: State, body: bytes, result: str, asked: Asked, kind: Kind) -> bytes:
    outcome = outcome_of(result, asked.rank)
    material = bc.Material.from_json(outcome.material)
    if isinstance(asked, Albedo):
        return plots.to_bytes(_albedo(material, outcome, asked), kind)
    samples = service.datasets.samples(FitRequest.model_validate_json(body))
    if isinstance(asked, Residuals):
        figure = plots.residuals_of(material, samples, channel=asked.channel)
    else:
        figure = plots.lobes(
            material, samples, theta_i_deg=asked.theta_i_deg or None, scale=asked.scale, channel=asked.channel
        )
    return plots.to_bytes(figure, kind)


def _albedo(material: bc.Material, outcome: FitOutcome, asked: Albedo) -> "Figure":
    label, channel = outcome.material_text, None
    if asked.channel is not None:
        if asked.channel not in outcome.channels:
            raise unknown_name("a channel", asked.channel, outcome.channels, field="channel")
        channel = min(outcome.channels.index(asked.channel), material.channels - 1)
        label += f", channel {asked.channel}"
    return plots.albedo({label: material}, phi_deg=asked.phi_deg, channel=channel)
