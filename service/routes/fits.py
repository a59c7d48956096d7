"""Fits: submitted, listed, read, cancelled and removed."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from brdfcore.fitting import check

from ..datasets import inline_samples, missing
from ..errors import WRITES, ProblemError, inlined, responses
from ..jobs.records import Job
from ..schemas import FitPage, FitRequest, FitSummary, FitView, RequestView, SamplesView
from ..state import state
from . import _jobs
from ._http import json_accepted, json_content, parsed

router = APIRouter(prefix="/v1/fits", tags=["fits"], dependencies=[Depends(json_accepted)])

_JSON_LIMIT = 16 * 2**20  # 10,000 rows of 31 channels with their deviations [bytes]
_BODY = {"required": True, "content": {"application/json": {"schema": inlined(FitRequest)}}}


@router.post(
    "",
    status_code=202,
    responses={
        200: {"model": FitView, "description": "finished"},
        **responses(406, 408, 409, 413, 415, 422, 429, *WRITES),
    },
    openapi_extra={"requestBody": _BODY},
)
async def submit(request: Request, response: Response) -> FitView:
    """Accept a fit; with `Prefer: wait=N` answer with the finished fit if that takes at most N s (60 at most)."""
    body = await json_content(request, _JSON_LIMIT)
    job = await asyncio.to_thread(_accepted, request, body)
    return FitView(**_jobs.view(await _jobs.accepted(request, response, job)))


@router.get("", responses=responses(406, 422))
async def page(request: Request, paging: Annotated[_jobs.Paging, Query()]) -> FitPage:
    """Fits without their results, newest first."""
    jobs, following = _jobs.page_of(state(request), "fit", paging)
    return FitPage(items=[FitSummary(**_jobs.summary(job)) for job in jobs], next=following)


@router.get("/{fit_id}", responses=responses(404, 406, 422))
async def read(request: Request, fit_id: str) -> FitView:
    """A fit: its status and progress, its result once it has succeeded, its error if it failed."""
    return FitView(**_jobs.view(_jobs.found(state(request), "fit", fit_id)))


@router.post("/{fit_id}/cancel", responses=responses(404, 406, 409, 422, *WRITES))
async def cancel(request: Request, fit_id: str) -> FitView:
    """Cancel a fit that is queued or running; its process ends at once."""
    return FitView(**_jobs.view(await _jobs.cancelled(state(request), "fit", fit_id)))


@router.delete("/{fit_id}", status_code=204, responses=responses(404, 406, 422, *WRITES))
async def remove(request: Request, fit_id: str) -> None:
    """Remove a fit and its inline samples for good, cancelling it first where it is not finished."""
    await _jobs.remove(state(request), "fit", fit_id)


def _accepted(request: Request, body: bytes) -> Job:
    """The new job, once all of its request that can be checked before the fit has been checked."""
    service, asked = state(request), parsed(FitRequest, body)
    summary = None
    if asked.samples is not None:
        count = len(asked.samples.values)
        if count > service.settings.inline_rows:
            raise ProblemError(
                413,
                f"Expected at most {service.settings.inline_rows} inline samples, got {count}. "
                "Upload them as a file with POST /v1/datasets.",
                field="samples",
            )
        samples = inline_samples(asked.samples)
        summary, channels = SamplesView(count=count, hash=samples.hash), len(samples.channels)
        azimuth_observed = samples.azimuth_observed
    else:
        dataset = service.datasets.get(asked.dataset or "")
        if dataset is None:
            raise missing(asked.dataset or "")
        channels, azimuth_observed = len(dataset.report["channels"]), dataset.report["azimuth_observed"]
    check(channels, asked.asked, **asked.arguments(), azimuth_observed=azimuth_observed)
    shown = RequestView(**asked.model_dump(exclude={"samples"}), samples=summary).model_dump_json()
    return _jobs.submitted(request, "fit", shown, body, azimuth_observed=azimuth_observed)
