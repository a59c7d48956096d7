"""Images of scenes: submitted, listed, read, cancelled, removed and sent."""

import asyncio
import json
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from .. import renders
from ..errors import WRITES, inlined, responses
from ..jobs.records import Job
from ..schemas import RenderPage, RenderRequest, RenderSummary, RenderView
from ..state import state
from . import _jobs
from ._http import accepted_of, json_accepted, json_content, parsed

router = APIRouter(prefix="/v1/renders", tags=["renders"])

_JSON = [Depends(json_accepted)]
_JSON_LIMIT = 2**18  # bytes
_MEDIA_TYPES: dict[renders.Kind, tuple[str, ...]] = {
    "png": ("image/png",),
    "npy": ("application/x-npy", "application/octet-stream"),
    "exr": ("image/x-exr", "application/octet-stream"),
}
_BODY = {"required": True, "content": {"application/json": {"schema": inlined(RenderRequest)}}}


@router.post(
    "",
    dependencies=_JSON,
    status_code=202,
    responses={
        200: {"model": RenderView, "description": "finished"},
        **responses(406, 408, 409, 413, 415, 422, 429, *WRITES),
    },
    openapi_extra={"requestBody": _BODY},
)
async def submit(request: Request, response: Response) -> RenderView:
    """Accept a scene to render; with `Prefer: wait=N` answer with the finished job if that takes at most N s."""
    body = await json_content(request, _JSON_LIMIT)
    job = await asyncio.to_thread(_submitted, request, body)
    return RenderView(**_jobs.view(await _jobs.accepted(request, response, job)))


@router.get("", dependencies=_JSON, responses=responses(406, 422))
async def page(request: Request, paging: Annotated[_jobs.Paging, Query()]) -> RenderPage:
    """Renders without their results, newest first."""
    jobs, following = _jobs.page_of(state(request), "render", paging)
    return RenderPage(items=[RenderSummary(**_jobs.summary(job)) for job in jobs], next=following)


@router.get("/{render_id}", dependencies=_JSON, responses=responses(404, 406, 422))
async def read(request: Request, render_id: str) -> RenderView:
    """A render: its status and progress, and once it has succeeded, its plan, its noise and what it cost."""
    return RenderView(**_jobs.view(_jobs.found(state(request), "render", render_id)))


def _file(kind: renders.Kind) -> dict[int | str, dict[str, object]]:
    content = {media_type: {"schema": {"format": "binary"}} for media_type in _MEDIA_TYPES[kind]}
    return {200: {"content": content}, **responses(404, 406, 409, 422)}


@router.get("/{render_id}/image.png", response_class=Response, responses=_file("png"))
async def image_png(request: Request, render_id: str) -> Response:
    """The image, exposed and encoded for screens, as PNG."""
    return await _image(request, render_id, "png")


@router.get("/{render_id}/image.npy", response_class=Response, responses=_file("npy"))
async def image_npy(request: Request, render_id: str) -> Response:
    """The linear radiance of every pixel, (height, width, 3) in single precision, as a NumPy file."""
    return await _image(request, render_id, "npy")


@router.get("/{render_id}/image.exr", response_class=Response, responses=_file("exr"))
async def image_exr(request: Request, render_id: str) -> Response:
    """The same as an OpenEXR file."""
    return await _image(request, render_id, "exr")


@router.post("/{render_id}/cancel", dependencies=_JSON, responses=responses(404, 406, 409, 422, *WRITES))
async def cancel(request: Request, render_id: str) -> RenderView:
    """Cancel a render that is queued or running; its process ends at once."""
    return RenderView(**_jobs.view(await _jobs.cancelled(state(request), "render", render_id)))


@router.delete("/{render_id}", dependencies=_JSON, status_code=204, responses=responses(404, 406, 422, *WRITES))
async def remove(request: Request, render_id: str) -> None:
    """Remove a render and its image for good, cancelling it first where it is not finished."""
    await _jobs.remove(state(request), "render", render_id, renders.remove)


def _submitted(request: Request, body: bytes) -> Job:
    """The new job, once all of its request that can be checked before the work has been checked."""
    return _jobs.submitted(request, "render", json.dumps(renders.checked(parsed(RenderRequest, body))), body)


async def _image(request: Request, render_id: str, kind: renders.Kind) -> Response:
    media_type = accepted_of(request, _MEDIA_TYPES[kind])
    return await _jobs.kept_file(request, "render", render_id, renders.content, kind, media_type)
