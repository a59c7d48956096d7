"""Every error as a problem document (RFC 9457), with one sentence that says what to do.

BrdfError (any)           422, `field` names the input at fault
ProblemError              the status and the sentence of the route that raised it
RequestValidationError    422, `errors` lists every field at fault
404, 405 (with Allow)     from the router
503, 507                  the store is locked for long; the disk is full: nothing of the request is kept
anything else             500, details in the log only
and before any route      401 without a known key, 421 for another's host, 431 for too large headers (guard.py)
"""

import http
import logging
import sqlite3
from collections.abc import Mapping, Sequence
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Match

from brdfcore.errors import BrdfError

from . import disk
from .schemas import FieldError, Problem

PROBLEM_TYPE = "application/problem+json"
WRITES = (503, 507)  # what whoever writes may meet
_METHODS = ("DELETE", "GET", "PATCH", "POST", "PUT")
_MOST_ERRORS = 20  # a body of 10,000 bad rows answers with the first ones

_log = logging.getLogger("service")


class ProblemError(HTTPException):
    """A refusal with its status, its sentence and, where there is one, the field at fault."""

    def __init__(
        self, status: int, detail: str, *, field: str | None = None, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(status, detail, headers)
        self.field = field


def install(app: FastAPI) -> None:
    """Make every error of the app a problem document."""
    app.add_exception_handler(BrdfError, _brdf_error)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(OSError, _disk_error)
    app.add_exception_handler(sqlite3.OperationalError, _disk_error)
    app.add_exception_handler(Exception, _internal)


def responses(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """What OpenAPI says of a route's errors."""
    content = {PROBLEM_TYPE: {"schema": inlined(Problem)}}
    every = (401, 421, 431, *statuses)  # the guard's come before any route
    return {status: {"description": http.HTTPStatus(status).phrase, "content": content} for status in every}


def inlined(model: type[BaseModel]) -> dict[str, Any]:
    """A model's JSON schema without references, so that it stands anywhere in an OpenAPI document."""
    schema = model.model_json_schema()
    shared = schema.pop("$defs", {})

    def resolved(node: Any) -> Any:
        if isinstance(node, list):
            return [resolved(item) for item in node]
        if isinstance(node, dict):
            if "$ref" in node:
                return resolved(shared[node["$ref"].rpartition("/")[2]])
            return {key: resolved(value) for key, value in node.items()}
        return node

    return dict(resolved(schema))


def problem(
    status: int,
    detail: str,
    *,
    field: str | None = None,
    errors: list[FieldError] | None = None,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """The response for one problem."""
    title = http.HTTPStatus(status).phrase
    body = Problem(title=title, status=status, detail=detail, field=field, errors=errors)
    text = body.model_dump_json(exclude_none=True)
    return Response(text, status, headers=headers, media_type=PROBLEM_TYPE)


async def _brdf_error(request: Request, error: Exception) -> Response:
    return problem(422, str(error), field=getattr(error, "field", None))


async def _invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)  # noqa: S101 - what it was registered for
    found = [FieldError(field=_path(e["loc"]) or "body", message=_message(e)) for e in error.errors()[:_MOST_ERRORS]]
    first = found[0]
    return problem(422, first.message, field=first.field, errors=found)


def _path(loc: Sequence[str | int]) -> str:
    """samples.wi[0] for ("body", "samples", "wi", 0); the tags of unions are no fields."""
    path = ""
    for part in loc[1:]:
        if isinstance(part, int):
            path += f"[{part}]"
        elif not part.startswith("<"):
            path += f".{part}" if path else part
    return path


def _message(error: Mapping[str, Any]) -> str:
    if error["type"] == "value_error":  # our own sentence, from a validator
        return str(error["ctx"]["error"])
    name = _path(error["loc"]) or "the body"
    if error["type"] == "json_invalid":
        return f"Expected {name} to be valid JSON in UTF-8. {error['msg']}."
    if error["type"] == "missing":
        return f"Expected {name} to be given, got nothing. Add it."
    if error["type"] == "extra_forbidden":
        return f"Expected no field {name}, because it has no meaning here. Remove it, or correct its name."
    rule, _, length = error["msg"].partition(" after validation, not ")
    rule = rule.partition(" should ")[2] or f"be {rule}"
    given = error["input"]
    shown = f", got {given!r}" if isinstance(given, str | int | float | None) and len(repr(given)) <= 80 else ""
    return f"Expected {name} to {rule}{f', got {length}' if length else shown}. Correct it."


async def _http_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)  # noqa: S101 - what it was registered for
    detail = str(error.detail)
    headers = {name.lower(): value for name, value in (error.headers or {}).items()}
    if not isinstance(error, ProblemError):  # raised by the router
        where = request.url.path
        if error.status_code == 404:
            detail = f"Expected the path of a resource, got {where!r}. GET /openapi.json lists what there is."
        elif error.status_code == 405:
            headers["allow"] = ", ".join(_allowed(request))
            detail = f"Expected one of {headers['allow']} for {where}, got {request.method}. Use one of them."
    return problem(error.status_code, detail, field=getattr(error, "field", None), headers=headers)


def _allowed(request: Request) -> list[str]:
    """The methods that the path of the request answers to, over all of its routes."""

    def answers(method: str) -> bool:
        scope = {**request.scope, "method": method}
        return any(route.matches(scope)[0] is Match.FULL for route in request.app.router.routes)

    return [method for method in _METHODS if answers(method)]


async def _disk_error(request: Request, error: Exception) -> Response:
    if disk.full(error):
        _log.error("%s %s found the disk full", request.method, request.url.path)
        return problem(
            507, "The service has no room left on its disk, and kept nothing of this. Make room, send it again."
        )
    if isinstance(error, sqlite3.OperationalError) and error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
        return problem(503, "The service is too busy to keep this now. Send it again.", headers={"retry-after": "1"})
    raise error


async def _internal(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    return problem(500, "The service failed at this request, through no fault of the request. Its log has the details.")
