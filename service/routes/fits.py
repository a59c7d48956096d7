"""Fits: submitted, listed, read, cancelled and removed."""

import asyncio
import json
import re
import time
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from brdfcore.fitting import check

from ..datasets import inline_samples, missing
from ..errors import ProblemError, inlined, responses
from ..jobs.store import Job
from ..schemas import FINISHED, FitPage, FitRequest, FitSummary, FitView, RequestView, SamplesView
from ..state import State, state
from ._http import chunks, json_accepted

router = APIRouter(prefix="/v1/fits", tags=["fits"], dependencies=[Depends(json_accepted)])

_LONGEST_WAIT = 60.0  # [s]
_JSON_LIMIT = 16 * 2**20  # 10,000 rows of 31 channels with their deviations [bytes]
_BODY = {"required": True, "content": {"application/json": {"schema": inlined(FitRequest)}}}


class Paging(BaseModel):
    """Which part of the list."""

    model_config = ConfigDict(extra="forbid")

    limit: int = Field(20, ge=1, le=100)
    cursor: int | None = Field(None, ge=1, lt=2**63, description="`next` of the page before")


@router.post(
    "",
    status_code=202,
    responses={200: {"model": FitView, "description": "finished"}, **responses(406, 408, 413, 415, 422)},
    openapi_extra={"requestBody": _BODY},
)
async def submit(request: Request, response: Response) -> FitView:
    """Accept a fit; with `Prefer: wait=N` answer with the finished fit if that takes at most N s (60 at most)."""
    if request.headers.get("content-type", "").partition(";")[0].strip().lower() != "application/json":
        raise ProblemError(415, "Expected Content-Type to be application/json. Send JSON, and files to /v1/datasets.")
    body = b"".join([piece async for piece in chunks(request, _JSON_LIMIT)])
    service = state(request)
    job = await asyncio.to_thread(_accepted, service, body)
    service.dispatcher.wake()
    response.headers["location"] = f"/v1/fits/{job.id}"
    seconds = _preferred_wait(request)
    if seconds is not None:
        response.headers["preference-applied"] = f"wait={seconds:g}"
        job = await _finished(request, job, seconds)
    if job.status in FINISHED:
        response.status_code = 200
    else:
        response.headers["retry-after"] = "1"
    return _view(job)


@router.get("", responses=responses(406, 422))
async def page(request: Request, paging: Annotated[Paging, Query()]) -> FitPage:
    """Fits without their results, newest first."""
    jobs = state(request).store.newest(paging.limit + 1, paging.cursor)
    shown = jobs[: paging.limit]
    more = len(jobs) > len(shown)
    return FitPage(items=[FitSummary(**_summary(job)) for job in shown], next=str(shown[-1].number) if more else None)


@router.get("/{fit_id}", responses=responses(404, 406, 422))
async def read(request: Request, fit_id: str) -> FitView:
    """A fit: its status and progress, its result once it has succeeded, its error if it failed."""
    return _view(found(state(request), fit_id))


@router.post("/{fit_id}/cancel", responses=responses(404, 406, 409, 422))
async def cancel(request: Request, fit_id: str) -> FitView:
    """Cancel a fit that is queued or running; its process ends at once."""
    service = state(request)
    job = await asyncio.to_thread(service.store.cancel, fit_id)
    if job is None:
        raise absent(fit_id)
    if job.status != "cancelled":
        raise ProblemError(
            409, f"Expected the fit to be queued or running, but it has {job.status}. Nothing to cancel."
        )
    service.dispatcher.wake()
    return _view(job)


@router.delete("/{fit_id}", status_code=204, responses=responses(404, 406, 422))
async def remove(request: Request, fit_id: str) -> None:
    """Remove a fit and its inline samples for good, cancelling it first where it is not finished."""
    service = state(request)
    if not await asyncio.to_thread(service.store.delete, fit_id):
        raise absent(fit_id)
    service.dispatcher.wake()


def found(service: State, fit_id: str) -> Job:
    """The job of that id; 404 where there is none."""
    job = service.store.get(fit_id)
    if job is None:
        raise absent(fit_id)
    return job


def absent(fit_id: str) -> ProblemError:
    """The 404 for a fit that does not exist."""
    return ProblemError(404, f"Expected the id of a fit, got {fit_id!r}. GET /v1/fits lists them.")


def _accepted(service: State, body: bytes) -> Job:
    """The new job, once all of its request that can be checked before the fit has been checked."""
    try:
        request = FitRequest.model_validate_json(body)
    except ValidationError as error:
        found = error.errors(include_url=False)
        raise RequestValidationError([{**e, "loc": ("body", *e["loc"])} for e in found]) from None
    summary = None
    if request.samples is not None:
        count = len(request.samples.values)
        if count > service.settings.inline_rows:
            raise ProblemError(
                413,
                f"Expected at most {service.settings.inline_rows} inline samples, got {count}. "
                "Upload them as a file with POST /v1/datasets.",
                field="samples",
            )
        samples = inline_samples(request.samples)
        summary, channels = SamplesView(count=count, hash=samples.hash), len(samples.channels)
        azimuth_observed = samples.azimuth_observed
    else:
        dataset = service.datasets.get(request.dataset or "")
        if dataset is None:
            raise missing(request.dataset or "")
        channels, azimuth_observed = len(dataset.report["channels"]), dataset.report["azimuth_observed"]
    check(
        channels,
        request.model,
        loss=request.loss,
        optimizer=request.optimizer,
        fixed=request.fixed,
        gray=tuple(request.gray),
        per_channel=tuple(request.per_channel),
        azimuth_observed=azimuth_observed,
    )
    shown = RequestView(**request.model_dump(exclude={"samples"}), samples=summary)
    return service.store.submit(shown.model_dump_json(), body)


def _preferred_wait(request: Request) -> float | None:
    """The seconds of `Prefer: wait=N` (RFC 7240), capped; what cannot be read is no preference."""
    match = re.search(
        r"(?:^|[,;])\s*wait\s*=\s*\"?(\d{1,9})\"?\s*(?:$|[,;])", ",".join(request.headers.getlist("prefer"))
    )
    return min(float(match[1]), _LONGEST_WAIT) if match else None


async def _finished(request: Request, job: Job, seconds: float) -> Job:
    """The job when it has ended, or as it stands after so long or when the server is about to end."""
    begun = time.monotonic()
    while job.status not in FINISHED and not request.app.state.ending():
        waited = time.monotonic() - begun
        if waited >= seconds:
            break
        # a tenth of the time so far: the answer is at most that late, and a long wait asks rarely
        await asyncio.sleep(min(max(waited / 10, 0.01), 0.5, seconds - waited))
        job = found(state(request), job.id)
    return job


def _summary(job: Job) -> dict[str, Any]:
    return {
        "id": job.id,
        "status": job.status,
        "progress": json.loads(job.progress) if job.progress else None,
        "request": json.loads(job.request),
        "error": job.error,
        "attempts": job.attempts,
        "created": _time(job.created),
        "started": _time(job.started),
        "finished": _time(job.finished),
    }


def _view(job: Job) -> FitView:
    return FitView(**_summary(job), result=json.loads(job.result) if job.result else None)


def _time(seconds: float | None) -> datetime | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)
