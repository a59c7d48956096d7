"""What several routes need of HTTP: bodies that are bounded and do not stall, and content negotiation."""

import asyncio
from collections.abc import AsyncIterator

from fastapi import Request
from starlette.requests import ClientDisconnect

from ..errors import ProblemError

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


def require_accepted(request: Request, media_type: str) -> None:
    """Refuse with 406 unless the request's Accept header admits the media type."""
    accept = request.headers.get("accept", "*/*")
    if not _admits(accept, media_type):
        raise ProblemError(
            406, f"Expected Accept to admit {media_type}, got {accept!r}. Nothing else is on offer here."
        )


async def json_accepted(request: Request) -> None:
    """Dependency of the routes that answer JSON only."""
    require_accepted(request, "application/json")


def _admits(accept: str, media_type: str) -> bool:
    """RFC 9110: the most specific range that matches decides, and q=0 means no."""
    family = media_type.partition("/")[0]
    quality = {}
    for item in accept.split(","):
        name, *parameters = (part.strip().lower() for part in item.split(";"))
        weight = next((p[2:] for p in parameters if p.startswith("q=")), "1")
        quality[name] = weight.rstrip("0.") != ""  # 0, 0.0, 0.00 and 0.000
    for name in (media_type, f"{family}/*", "*/*"):
        if name in quality:
            return quality[name]
    return False
