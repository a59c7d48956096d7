"""GET /v1/fits/{fit_id}/events, and those of tables and renders: a job's progress as server-sent events."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent

from ..errors import responses
from ..jobs.records import Job
from ..schemas import FINISHED, JobKind, ProgressEvent
from ..state import state
from . import _jobs
from ._http import require_accepted

router = APIRouter(tags=["progress"])

_LOOK = 0.1  # how often the store is looked at [s]
_LONGEST = 3600.0  # after which the client is left to connect again [s]


async def _fit(request: Request, fit_id: str) -> Job:
    return _found(request, "fit", fit_id)


async def _table(request: Request, table_id: str) -> Job:
    return _found(request, "albedo_table", table_id)


async def _render(request: Request, render_id: str) -> Job:
    return _found(request, "render", render_id)


def _found(request: Request, kind: JobKind, job_id: str) -> Job:
    require_accepted(request, "text/event-stream")
    return _jobs.found(state(request), kind, job_id)


Last = Annotated[str | None, Header(alias="last-event-id", description="the event after which to go on")]


@router.get("/v1/fits/{fit_id}/events", response_class=EventSourceResponse, responses=responses(404, 406, 422))
async def fit_events(
    request: Request, job: Annotated[Job, Depends(_fit)], last: Last = None
) -> AsyncIterator[ServerSentEvent]:
    """Stream a fit's progress: `progress` whenever it changes, then one event named by the status it ends with."""
    async for event in _events(request, job, last):
        yield event


@router.get("/v1/albedo/{table_id}/events", response_class=EventSourceResponse, responses=responses(404, 406, 422))
async def table_events(
    request: Request, job: Annotated[Job, Depends(_table)], last: Last = None
) -> AsyncIterator[ServerSentEvent]:
    """Stream a table's progress: `progress` whenever it changes, then one event named by the status it ends with."""
    async for event in _events(request, job, last):
        yield event


@router.get("/v1/renders/{render_id}/events", response_class=EventSourceResponse, responses=responses(404, 406, 422))
async def render_events(
    request: Request, job: Annotated[Job, Depends(_render)], last: Last = None
) -> AsyncIterator[ServerSentEvent]:
    """Stream a render's progress: `progress` whenever it changes, then one event named by the status it ends with."""
    async for event in _events(request, job, last):
        yield event


async def _events(request: Request, job: Job, last: str | None) -> AsyncIterator[ServerSentEvent]:
    """What is new of a job since the event `last`; one that was removed meanwhile ends as cancelled."""
    store, seen = state(request).store, last
    end = asyncio.get_running_loop().time() + _LONGEST
    current: Job | None = job
    while current is not None:
        view = ProgressEvent(**{k: v for k, v in _jobs.summary(current).items() if k in ProgressEvent.model_fields})
        over = current.status in FINISHED
        number = f"{current.attempts}.{current.status}.{view.progress.fraction if view.progress else 0:.4f}"
        if number != seen or over:
            seen = number
            yield ServerSentEvent(data=view, event=current.status if over else "progress", id=number)
        if over or request.app.state.ending() or asyncio.get_running_loop().time() > end:
            return
        await asyncio.sleep(_LOOK)
        current = store.get(job.id)
    gone = ProgressEvent(status="cancelled", progress=None, error=None, attempts=job.attempts)
    yield ServerSentEvent(data=gone, event="cancelled", id="gone")
