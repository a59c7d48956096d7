"""Directional albedos: values at once, tables as jobs."""

import asyncio
import json
import math
from typing import Annotated

import torch
from fastapi import APIRouter, Depends, Query, Request, Response

import brdfcore as bc
from brdfcore.energy._described import described

from .. import tables
from ..errors import WRITES, ProblemError, inlined, responses
from ..jobs.records import Job
from ..materials import material_of
from ..schemas import AlbedoRequest, AlbedoView, TablePage, TableSummary, TableView
from ..state import state
from . import _jobs
from ._http import accepted_of, json_accepted, json_content, parsed

router = APIRouter(prefix="/v1/albedo", tags=["albedo"])

_JSON = [Depends(json_accepted)]
_JSON_LIMIT = 2**20  # bytes
_MOST_INTEGRALS = {1e-7: 1000, 0.0: 100}  # directions times terms for tolerances from these on: up to 20 s of work
_CERTIFYING = 50  # integrals that take as long as the certificate of one term
_MOST_CHANNELS = 64  # each may be a lobe of its own
_TOLERANCE = 1e-6  # where a request states none
_NPZ = ("application/x-npz", "application/octet-stream")
_BODY = {"required": True, "content": {"application/json": {"schema": inlined(AlbedoRequest)}}}
_FILE = {kind: {"schema": {"format": "binary"}} for kind in _NPZ} | {"application/json": {"schema": {"type": "object"}}}


@router.post(
    "",
    dependencies=_JSON,
    response_class=Response,
    responses={
        200: {"model": AlbedoView | TableView, "description": "the values, or a finished table"},
        202: {"model": TableView, "description": "a table, accepted"},
        **responses(406, 408, 409, 413, 415, 422, 429, *WRITES),
    },
    openapi_extra={"requestBody": _BODY},
)
async def albedo(request: Request) -> Response:
    """Give directional albedos at once, each with its error, or accept a table over angles and parameters as a job.

    A table answers as a fit does: 202 and where to look, or with `Prefer: wait=N` the finished job.
    """
    content = await json_content(request, _JSON_LIMIT)
    service = state(request)
    asked = await asyncio.to_thread(parsed, AlbedoRequest, content)
    if asked.axes is None:
        loop = asyncio.get_running_loop()
        thread = service.aside if asked.certificate else service.computing  # it may take a second
        answer = await loop.run_in_executor(thread, _values, asked)
        return Response(answer, media_type="application/json")
    response = Response(media_type="application/json")
    job = await asyncio.to_thread(_submitted, request, asked, content)
    job = await _jobs.accepted(request, response, job)
    response.body = TableView(**_jobs.view(job)).model_dump_json().encode()
    response.headers["content-length"] = str(len(response.body))
    return response


@router.get("", dependencies=_JSON, responses=responses(406, 422))
async def page(request: Request, paging: Annotated[_jobs.Paging, Query()]) -> TablePage:
    """Tables without their results, newest first."""
    jobs, following = _jobs.page_of(state(request), "albedo_table", paging)
    return TablePage(items=[TableSummary(**_jobs.summary(job)) for job in jobs], next=following)


@router.get("/{table_id}", dependencies=_JSON, responses=responses(404, 406, 422))
async def read(request: Request, table_id: str) -> TableView:
    """A table: its status and progress, and once it has succeeded, its axes, its error and what it cost."""
    return TableView(**_jobs.view(_jobs.found(state(request), "albedo_table", table_id)))


@router.get(
    "/{table_id}/table",
    response_class=Response,
    responses={200: {"content": _FILE}, **responses(404, 406, 409, 422)},
)
async def table(request: Request, table_id: str) -> Response:
    """The table's numbers as JSON, which says how to read them, or as a NumPy archive, by the Accept header."""
    media_type = accepted_of(request, ("application/json", *_NPZ))
    kind: tables.Kind = "npz" if media_type in _NPZ else "json"
    return await _jobs.kept_file(request, "albedo_table", table_id, tables.content, kind, media_type)


@router.post("/{table_id}/cancel", dependencies=_JSON, responses=responses(404, 406, 409, 422, *WRITES))
async def cancel(request: Request, table_id: str) -> TableView:
    """Cancel a table that is queued or running; its process ends at once."""
    return TableView(**_jobs.view(await _jobs.cancelled(state(request), "albedo_table", table_id)))


@router.delete("/{table_id}", dependencies=_JSON, status_code=204, responses=responses(404, 406, 422, *WRITES))
async def remove(request: Request, table_id: str) -> None:
    """Remove a table for good, cancelling it first where it is not finished."""
    await _jobs.remove(state(request), "albedo_table", table_id, tables.remove)


def _submitted(request: Request, asked: AlbedoRequest, content: bytes) -> Job:
    """The new job, once all of its request that can be checked before the work has been checked."""
    return _jobs.submitted(request, "albedo_table", json.dumps(tables.checked(asked)), content)


def _values(asked: AlbedoRequest) -> str:
    """The albedos as JSON."""
    material, theta_deg = material_of(asked.material), asked.theta_deg or []
    tolerance = _TOLERANCE if asked.tolerance is None else asked.tolerance
    most = next(count for least, count in _MOST_INTEGRALS.items() if tolerance >= least)
    integrals = (len(theta_deg) + _CERTIFYING * asked.certificate) * len(material.form.terms)
    if integrals > most or material.channels > _MOST_CHANNELS:
        raise ProblemError(
            422,
            f"Expected at most {most} angles times terms at the tolerance {tolerance:g} and at most {_MOST_CHANNELS} "
            f"channels, got {integrals} and {material.channels}. Ask in several requests, or for a table.",
            field="theta_deg",
        )
    theta = torch.deg2rad(torch.tensor(theta_deg, dtype=torch.float64))
    with torch.no_grad():
        found = bc.albedo(material, theta, math.radians(asked.phi_deg), tolerance)
    view = described(material, theta_deg, asked.phi_deg, found)
    if asked.certificate:
        view["certificate"] = bc.certify(material).to_dict()
    return json.dumps(view, allow_nan=False)
