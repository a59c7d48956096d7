"""What several routes need of HTTP: bodies that are bounded and do not stall, and content negotiation."""

import asyncio
import re
from collections.abc import AsyncIterator, Sequence
from typing import TypeVar

from fastapi import Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ValidationError
from starlette.requests import ClientDisconnect

from ..errors import ProblemError

_Body = TypeVar("_Body", bound=BaseModel)
_STALL = 30.0  # longest that a client may send nothing in the middle of a body [s]


async def chunks(request: Request, limit: int) -> AsyncIterator[bytes]:
    """The body piece by piece; 413 beyond `limit` bytes, 408 if it stalls, 415 if it is compressed."""
    coding = request.headers.get("content-encoding", "identity")
    if coding.lower() != "identity":
        raise ProblemError(
            415,
            f"Expected the body to be sent as it is, got Content-Encoding {coding}. Send it uncompressed.",
            headers={"accept-encoding": "identity"},
        )
    declared = request.headers.get("content-length", "")
    total = int(declared) if declared.isdecimal() else 0
    pieces = aiter(request.stream())
    received = 0
    while total <= limit:
        try:
            async with asyncio.timeout(_STALL):
                piece = await anext(pieces, None)
        except TimeoutError:
            raise ProblemError(
                408, f"Expected the body to keep coming, but nothing came for {_STALL:g} s. Send it again."
            ) from None
        except ClientDisconnect:
            raise ProblemError(400, "Expected the whole body, but the connection was closed. Send it again.") from None
        if piece is None:
            return
        received += len(piece)
        total = max(total, received)
        if total <= limit:
            yield piece
    raise ProblemError(
        413, f"Expected a body of at most {limit} bytes, got {total} or more. Send less, or raise the server's limit."
    )


async def json_content(request: Request, limit: int) -> bytes:
    """The body of a request that declares JSON; 415 where it declares another type."""
    if request.headers.get("content-type", "").partition(";")[0].strip().lower() != "application/json":
        raise ProblemError(415, "Expected Content-Type to be application/json. Send JSON, and files to /v1/datasets.")
    return b"".join([piece async for piece in chunks(request, limit)])


def parsed(model: type[_Body], content: bytes) -> _Body:
    """What the JSON says; 422 names every field at fault. Large bodies take their time: call it in a thread."""
    try:
        return model.model_validate_json(content)
    except ValidationError as error:
        found = error.errors(include_url=False)
        raise RequestValidationError([{**e, "loc": ("body", *e["loc"])} for e in found]) from None


def require_accepted(request: Request, media_type: str) -> None:
    """Refuse with 406 unless the request's Accept header admits the media type."""
    accepted_of(request, (media_type,))


def accepted_of(request: Request, offered: Sequence[str]) -> str:
    """The first media type on offer that the request's Accept header admits most; 406 where it admits none."""
    accept = request.headers.get("accept", "*/*")
    quality = {media_type: _quality(accept, media_type) for media_type in offered}
    best = max(offered, key=lambda media_type: quality[media_type])
    if not quality[best]:
        raise ProblemError(
            406, f"Expected Accept to admit {' or '.join(offered)}, got {accept!r}. Nothing else is on offer here."
        )
    return best


async def json_accepted(request: Request) -> None:
    """Dependency of the routes that answer JSON only."""
    require_accepted(request, "application/json")


def unchanged(request: Request, tag: str) -> bool:
    """Whether the client has what an entity tag names, by its If-None-Match; a 304 says so."""
    known = [name.strip().removeprefix("W/") for name in request.headers.get("if-none-match", "").split(",")]
    return tag in known or "*" in known


def _quality(accept: str, media_type: str) -> float:
    """How much a media type is wanted, 0 to 1; RFC 9110: the most specific range that matches decides."""
    family = media_type.partition("/")[0]
    quality = {}
    for item in accept.split(","):
        name, *parameters = (part.strip().lower() for part in item.split(";"))
        weight = next((p[2:] for p in parameters if p.startswith("q=")), "1")
        quality[name] = float(weight) if re.fullmatch(r"[01](\.\d{0,3})?", weight) else 1.0
    for name in (media_type, f"{family}/*", "*/*"):
        if name in quality:
            return quality[name]
    return 0.0
