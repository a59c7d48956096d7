"""Batches: one or several models fitted to many datasets, with one progress and one table."""

import asyncio
import csv
import io
import json
from collections import Counter
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response

from brdfcore.errors import BrdfError
from brdfcore.fitting import check

from ..errors import WRITES, ProblemError, inlined, responses
from ..jobs.records import Asked, Batch, Job
from ..schemas import FINISHED, BatchPage, BatchRequest, BatchRow, BatchTable, BatchView, FitRequest, RequestView
from ..state import State, state
from . import _jobs
from ._http import accepted_of, json_accepted, json_content, parsed

router = APIRouter(prefix="/v1/batches", tags=["batches"])

_JSON = [Depends(json_accepted)]
_UNFINISHED = 0.99  # most that a fit counts which runs: after its last step it still has to be judged and kept
_LIMIT = 2**20  # a thousand datasets and twenty models [bytes]
_BODY = {"required": True, "content": {"application/json": {"schema": inlined(BatchRequest)}}}
_TABLE = {"application/json": {"schema": inlined(BatchTable)}, "text/csv": {"schema": {"type": "string"}}}


@router.post(
    "",
    status_code=202,
    dependencies=_JSON,
    responses=responses(406, 408, 409, 413, 415, 422, 429, *WRITES),
    openapi_extra={"requestBody": _BODY},
)
async def submit(request: Request, response: Response) -> BatchView:
    """Accept a fit of every model to every dataset; all of them are checked before any is accepted."""
    content = await json_content(request, _LIMIT)
    batch = await asyncio.to_thread(_accepted, request, content)
    service = state(request)
    service.dispatcher.wake()
    response.headers["location"] = f"/v1/batches/{batch.id}"
    response.headers["retry-after"] = "1"
    return _view(service, batch)


@router.get("", dependencies=_JSON, responses=responses(406, 422))
async def page(request: Request, paging: Annotated[_jobs.Page, Query()]) -> BatchPage:
    """Batches, newest first."""
    service = state(request)
    found = service.store.batches(paging.limit + 1, paging.cursor)
    shown = found[: paging.limit]
    following = str(shown[-1].number) if len(found) > len(shown) else None
    return BatchPage(items=[_view(service, batch) for batch in shown], next=following)


@router.get("/{batch_id}", dependencies=_JSON, responses=responses(404, 406, 422))
async def read(request: Request, batch_id: str) -> BatchView:
    """A batch: how many of its fits are done, and what fraction of the work."""
    return _view(state(request), _found(state(request), batch_id))


@router.get(
    "/{batch_id}/table", response_class=Response, responses={200: {"content": _TABLE}, **responses(404, 406, 422)}
)
async def table(request: Request, batch_id: str) -> Response:
    """The fits of a batch as they stand, a row each, as JSON or CSV by the Accept header."""
    media_type = accepted_of(request, ("application/json", "text/csv"))
    service = state(request)
    rows = [_row(job) for job in service.store.of_batch(_found(service, batch_id).id)]
    if media_type == "text/csv":
        return Response(_csv(rows), media_type="text/csv; charset=utf-8", headers={"vary": "accept"})
    return Response(BatchTable(rows=rows).model_dump_json(), media_type=media_type, headers={"vary": "accept"})


@router.post("/{batch_id}/cancel", dependencies=_JSON, responses=responses(404, 406, 422, *WRITES))
async def cancel(request: Request, batch_id: str) -> BatchView:
    """Cancel those fits of a batch that are queued or running."""
    service = state(request)
    batch = _found(service, batch_id)
    await asyncio.to_thread(service.store.cancel_batch, batch.id)
    service.dispatcher.wake()
    return _view(service, batch)


@router.delete("/{batch_id}", status_code=204, dependencies=_JSON, responses=responses(404, 406, 422, *WRITES))
async def remove(request: Request, batch_id: str) -> None:
    """Remove a batch and its fits for good."""
    service = state(request)
    if not await asyncio.to_thread(service.store.delete_batch, _found(service, batch_id).id):
        raise _absent(batch_id)
    service.dispatcher.wake()


def _accepted(request: Request, content: bytes) -> Batch:
    """The new batch, once every fit of it has been checked as far as it can be before it runs."""
    service, asked = state(request), parsed(BatchRequest, content)
    options = asked.model_dump(exclude={"datasets", "models"})
    made = []
    for index, name in enumerate(asked.datasets):
        dataset = service.datasets.get(name)
        if dataset is None:
            raise BrdfError(
                f"Expected datasets[{index}] to be the id of an uploaded dataset, got {name!r}. "
                "Upload it with POST /v1/datasets.",
                field=f"datasets[{index}]",
            )
        channels, observed = len(dataset.report["channels"]), dataset.report["azimuth_observed"]
        for model in asked.models:
            fit = FitRequest(dataset=name, model=model, **options)
            check(channels, model, **fit.arguments(), azimuth_observed=observed)
            shown = RequestView(**fit.model_dump(exclude={"samples"}), samples=None).model_dump_json()
            work = _jobs.work_of("fit", shown, azimuth_observed=observed)
            made.append(Asked(shown, fit.model_dump_json().encode(), "fit", work))
    with _jobs.refusals(request) as (owner, most, promise):
        return service.store.submit_batch(
            asked.model_dump_json(), made, owner=owner, most=most, promise=promise("batch", content)
        )


def _found(service: State, batch_id: str) -> Batch:
    batch = service.store.batch(batch_id)
    if batch is None:
        raise _absent(batch_id)
    return batch


def _absent(batch_id: str) -> ProblemError:
    return ProblemError(404, f"Expected the id of a batch, got {batch_id!r}. GET /v1/batches lists them.")


def _view(service: State, batch: Batch) -> BatchView:
    jobs, request = service.store.standing(batch.id), json.loads(batch.request)
    done = [
        1.0 if status in FINISHED else min(json.loads(said)["fraction"], _UNFINISHED) if said else 0.0
        for status, said in jobs
    ]
    return BatchView(
        id=batch.id,
        created=_jobs.time_of(batch.created),
        datasets=len(request["datasets"]),
        models=request["models"],
        finished=all(status in FINISHED for status, _ in jobs),
        fraction=sum(done) / len(done) if done else 1.0,
        counts=dict(Counter(status for status, _ in jobs)),
    )


def _row(job: Job) -> BatchRow:
    request, result = json.loads(job.request), json.loads(job.result or "{}")
    return BatchRow(
        dataset=request["dataset"],
        model=request["model"],
        fit=job.id,
        status=job.status,
        fit_status=result.get("status"),
        errors=result.get("errors"),
        parameters=result.get("parameters"),
        undetermined=result.get("undetermined"),
        seconds=result["cost"]["seconds"] if result else None,
        error=job.error,
    )


def _csv(rows: list[BatchRow]) -> str:
    """A header and a row a fit: errors by loss, and parameters by key, or key and channel."""
    flat = []
    for row in rows:
        cells: dict[str, Any] = row.model_dump(exclude={"errors", "parameters", "undetermined"})
        cells["undetermined"] = " ".join(row.undetermined or ())
        cells |= {f"error_{name}": value for name, value in (row.errors or {}).items()}
        for key, value in (row.parameters or {}).items():
            if isinstance(value, list):
                cells |= {f"{key}[{channel}]": one for channel, one in enumerate(value)}
            else:
                cells[key] = value
        flat.append(cells)
    names = dict.fromkeys(name for cells in flat for name in cells)
    out = io.StringIO()
    writer = csv.DictWriter(out, names, restval="")
    writer.writeheader()
    writer.writerows(flat)
    return out.getvalue()
