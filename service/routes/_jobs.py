"""What the routes of every kind of job share: finding, waiting, cancelling, removing, and what is shown of a job."""

import asyncio
import contextlib
import hashlib
import json
import re
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from fastapi import Request, Response
from pydantic import BaseModel, ConfigDict, Field

import brdfcore as bc
from brdfcore.errors import InvalidValueError

from ..errors import ProblemError
from ..jobs.records import BrokenPromiseError, Job, Promise, QueueFullError
from ..schemas import FINISHED, FitOutcome, JobKind, JobStatus
from ..state import State, state
from ._http import unchanged

_LONGEST_WAIT = 60.0  # [s]
_Suffix = TypeVar("_Suffix", bound=str)
_NAME: dict[JobKind, str] = {"fit": "fit", "albedo_table": "table of albedos", "render": "render"}
_PATH: dict[JobKind, str] = {"fit": "/v1/fits", "albedo_table": "/v1/albedo", "render": "/v1/renders"}


class Ranked(BaseModel):
    """Which of the models is meant, where several were compared."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    rank: int = Field(1, ge=1, le=32, description="of the model, where several were compared; 1 is the best")


class Page(BaseModel):
    """Which part of a list."""

    model_config = ConfigDict(extra="forbid")

    limit: int = Field(20, ge=1, le=100)
    cursor: int | None = Field(None, ge=1, lt=2**63, description="`next` of the page before")


class Paging(Page):
    """Which part of a list of jobs."""

    status: JobStatus | None = Field(None, description="only those of this status")


def submitted(request: Request, kind: JobKind, shown: str, body: bytes, **identity: object) -> Job:
    """The new job; the same as before where its Idempotency-Key was seen, with an earlier result where its work was.

    shown is the JSON of its request, which with the identity determines the result. Raises as `refusals` does.
    """
    work = work_of(kind, shown, **identity)
    with refusals(request) as (owner, most, promise):
        return state(request).store.submit(
            shown, body, kind, work=work, owner=owner, most=most, promise=promise(kind, body)
        )


def work_of(kind: JobKind, shown: str, **identity: object) -> str:
    """The hash of all that determines a job's result."""
    work = {"version": bc.__version__, "kind": kind, "request": json.loads(shown), **identity}
    return _digest(json.dumps(work))


@contextlib.contextmanager
def refusals(request: Request) -> Iterator[tuple[str, int, Callable[[str, bytes], Promise | None]]]:
    """The owner of what is submitted, the most unfinished jobs of that owner, and what makes the request's promise.

    409 where the Idempotency-Key came with another body, 429 where the owner's queue is full, 422 for what is no key.
    """
    owner, most = request.state.owner or "", state(request).settings.queue_limit
    key = request.headers.get("idempotency-key")
    if key is not None and not (0 < len(key) <= 255 and key.isascii() and key.isprintable()):
        raise ProblemError(
            422,
            "Expected Idempotency-Key to be 1 to 255 printable characters. Use a new UUID for each submission.",
            field="Idempotency-Key",
        )
    try:
        yield (
            owner,
            most,
            lambda kind, body: None if key is None else Promise(_digest(f"{owner} {kind} {key}"), _digest(body)),
        )
    except BrokenPromiseError:
        raise ProblemError(
            409,
            f"Expected the body that came first with the Idempotency-Key {key!r}, got another. Use a new key.",
            field="Idempotency-Key",
        ) from None
    except QueueFullError:
        raise ProblemError(
            429,
            f"Expected at most {most} unfinished jobs at a time, got more. Wait for some of them to end.",
            headers={"retry-after": "10"},
        ) from None


def _digest(content: str | bytes) -> str:
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


async def accepted(request: Request, response: Response, job: Job) -> Job:
    """The job that was submitted just now, after what the request prefers to wait; the response says how it stands."""
    state(request).dispatcher.wake()
    response.headers["location"] = f"{_PATH[job.kind]}/{job.id}"
    seconds = _preferred_wait(request)
    if seconds is not None:
        response.headers["preference-applied"] = f"wait={seconds:g}"
        job = await _finished(request, job, seconds)
    if job.status in FINISHED:
        response.status_code = 200
    else:
        response.status_code = 202
        response.headers["retry-after"] = "1"
    return job


def page_of(service: State, kind: JobKind, paging: Paging) -> tuple[list[Job], str | None]:
    """The jobs of a page, newest first, and the cursor of the next one."""
    jobs = service.store.newest(paging.limit + 1, paging.cursor, kind, paging.status)
    shown = jobs[: paging.limit]
    return shown, str(shown[-1].number) if len(jobs) > len(shown) else None


def found(service: State, kind: JobKind, job_id: str) -> Job:
    """The job of that kind and id; 404 where there is none."""
    job = service.store.get(job_id)
    if job is None or job.kind != kind:
        raise absent(kind, job_id)
    return job


def absent(kind: JobKind, job_id: str) -> ProblemError:
    """The 404 for a job that does not exist."""
    return ProblemError(404, f"Expected the id of a {_NAME[kind]}, got {job_id!r}. GET {_PATH[kind]} lists them.")


async def cancelled(service: State, kind: JobKind, job_id: str) -> Job:
    """The job, cancelled just now or before; 409 where it has ended otherwise."""
    found(service, kind, job_id)
    job = await asyncio.to_thread(service.store.cancel, job_id)
    if job is None:
        raise absent(kind, job_id)
    if job.status != "cancelled":
        raise ProblemError(
            409, f"Expected the {_NAME[kind]} to be queued or running, but it has {job.status}. Nothing to cancel."
        )
    service.dispatcher.wake()
    return job


async def remove(service: State, kind: JobKind, job_id: str, files: Callable[[Path, str], None] | None = None) -> None:
    """Remove the job for good and, with `files`, what it has on disk under a hash unless another job made the same."""
    found(service, kind, job_id)
    job = await asyncio.to_thread(service.store.delete, job_id)  # with the result that came since
    if job is None:
        raise absent(kind, job_id)
    service.dispatcher.wake()
    if files is not None and job.result is not None:
        name = json.loads(job.result)["hash"]
        if not await asyncio.to_thread(service.store.mentioned, kind, name):
            await asyncio.to_thread(files, service.settings.data, name)


def result_of(job: Job) -> str:
    """The result of a job as JSON; 409 where it has none."""
    if job.result is None:
        raise ProblemError(
            409,
            f"Expected the {_NAME[job.kind]} to have succeeded, but it is {job.status}. "
            "Only then is there something to send.",
        )
    return job.result


async def kept_file(
    request: Request,
    kind: JobKind,
    job_id: str,
    read: Callable[[Path, str, _Suffix], bytes | None],
    suffix: _Suffix,
    media_type: str,
) -> Response:
    """What a job has on disk under a hash, as `read` gives it; 304 where the client has it."""
    service = state(request)
    name = json.loads(result_of(found(service, kind, job_id)))["hash"]
    headers = {"etag": f'"{name[:32]}-{suffix}"', "cache-control": "private, no-cache", "vary": "accept"}
    if unchanged(request, headers["etag"]):
        return Response(status_code=304, headers=headers)
    content = await asyncio.to_thread(read, service.settings.data, name, suffix)
    if content is None:  # removed just now with another job that had made the same
        raise ProblemError(
            404, f"Expected what the {_NAME[kind]} {job_id!r} has made to be kept. Post its request again."
        )
    return Response(content, headers=headers, media_type=media_type)


def summary(job: Job) -> dict[str, Any]:
    """What is shown of a job of any kind, without its result."""
    return {
        "id": job.id,
        "status": job.status,
        "progress": json.loads(job.progress) if job.progress else None,
        "request": json.loads(job.request),
        "error": job.error,
        "reused": job.reused,
        "attempts": job.attempts,
        "created": time_of(job.created),
        "started": None if job.started is None else time_of(job.started),
        "finished": None if job.finished is None else time_of(job.finished),
    }


def view(job: Job) -> dict[str, Any]:
    """The summary and the result."""
    return {**summary(job), "result": json.loads(job.result) if job.result else None}


def outcome_of(result: str, rank: int) -> FitOutcome:
    """What a fit found: of several models that were compared, that of a rank from 1; 422 where there is none."""
    found = json.loads(result)
    fits = [one["fit"] for one in found["comparison"]["ranking"]] if "comparison" in found else [found]
    if rank > len(fits):
        raise InvalidValueError(
            f"Expected rank to be at most {len(fits)}, the number of models that were fitted, got {rank}. "
            "GET the fit for its ranking.",
            field="rank",
        )
    return FitOutcome.model_validate(fits[rank - 1])


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
        job = found(state(request), job.kind, job.id)
    return job


def time_of(seconds: float) -> datetime:
    """The time of so many seconds since 1970."""
    return datetime.fromtimestamp(seconds, UTC)
