"""GET / and /static: the page for people, and the files it is made of."""

import asyncio
import gzip
import hashlib
import mimetypes
from functools import cache
from pathlib import Path
from typing import NamedTuple

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse

from brdfcore.demo import DATA

from ..errors import ProblemError, responses
from ._http import accepted_of, unchanged

router = APIRouter(tags=["page"])

FOLDER = Path(__file__).parent.parent / "static"
_TYPES = {".js": "text/javascript", ".csv": "text/csv", "": "text/plain"}  # the system's table may say otherwise
_START = {"docs": "/docs", "openapi": "/openapi.json", "fits": "/v1/fits"}


class _File(NamedTuple):
    content: bytes
    packed: bytes  # the same by gzip, once: a quarter of it travels
    media_type: str
    tag: str


@cache
def files() -> dict[str, Path]:
    """Every file of the page by its name under /static/; the example measurement is one of them."""
    found = {path.relative_to(FOLDER).as_posix(): path for path in sorted(FOLDER.rglob("*")) if path.is_file()}
    return {**found, "example.csv": DATA}


@router.get(
    "/",
    response_class=Response,
    responses={
        200: {
            "description": "where to read on, or the page for people where Accept asks for text/html",
            "content": {
                "application/json": {"schema": {"type": "object", "additionalProperties": {"type": "string"}}},
                "text/html": {"schema": {"type": "string"}},
            },
        },
        **responses(406),
    },
)
async def root(request: Request) -> Response:
    """Where to read on; a browser, which asks for text/html, gets the page."""
    if accepted_of(request, ("application/json", "text/html")) == "text/html":
        answer = await _answer(request, "index.html")
    else:
        answer = JSONResponse(_START)
    answer.headers["vary"] = "accept, accept-encoding"
    return answer


@router.get("/static/{name:path}", include_in_schema=False)
async def static(request: Request, name: str) -> Response:
    """A file of the page."""
    if name not in files():
        raise ProblemError(404, f"Expected a file of the page, got {name!r}. GET / names the page itself.")
    return await _answer(request, name)


async def _answer(request: Request, name: str) -> Response:
    file = await asyncio.to_thread(_read, name)
    # kept, and asked for again: an update shows at once
    headers = {"etag": file.tag, "cache-control": "no-cache", "vary": "accept-encoding"}
    if unchanged(request, file.tag):
        return Response(status_code=304, headers=headers)
    if "gzip" in request.headers.get("accept-encoding", ""):
        headers["content-encoding"] = "gzip"
        return Response(file.packed, headers=headers, media_type=file.media_type)
    return Response(file.content, headers=headers, media_type=file.media_type)


@cache
def _read(name: str) -> _File:
    path = files()[name]
    content = path.read_bytes()
    kind = _TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return _File(content, gzip.compress(content, mtime=0), kind, f'W/"{hashlib.sha256(content).hexdigest()[:32]}"')
