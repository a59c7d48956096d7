"""What stands before every route: a request's id, the key, the size of headers, and what every answer carries."""

import logging
import re
import time
import uuid
from collections.abc import Collection

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from . import keys
from .errors import problem
from .metrics import Metrics
from .settings import Settings

OPEN = ("/", "/docs", "/healthz", "/readyz")  # that answer without a key, and hold no data; so does what is under PAGE
PAGE = "/static/"
HEADER_LIMIT = 32 * 1024  # bytes of all headers together
_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
_CARRIED = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "content-security-policy": "default-src 'none'; frame-ancestors 'none'",
}
# the page runs its own files only, and speaks to its own service only
_PAGE = "default-src 'self'; base-uri 'none'; form-action 'none'; object-src 'none'; frame-ancestors 'none'"

_log = logging.getLogger("service.requests")


class Guard:
    """ASGI middleware that refuses what must not reach a route, and logs and counts what was answered."""

    def __init__(self, app: ASGIApp, settings: Settings, metrics: Metrics, hosts: Collection[str] = ()) -> None:
        """Stand before `app`; where `hosts` are given, a request names one of them as its host."""
        self.app, self.settings, self.metrics, self.hosts = app, settings, metrics, hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        begun, status = time.perf_counter(), 500
        headers = Headers(scope=scope)
        given = headers.get("x-request-id", "")
        request_id = given if _ID.fullmatch(given) else uuid.uuid4().hex
        owner = keys.owner_of(headers.get("authorization", ""), self.settings.api_keys)
        scope.setdefault("state", {}).update(request_id=request_id, owner=owner)

        async def answer(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                carried = MutableHeaders(scope=message)
                carried["x-request-id"] = request_id
                for name, value in _CARRIED.items():
                    carried.setdefault(name, value)
                if scope["path"] in ("/", "/docs") or scope["path"].startswith(PAGE):
                    carried["content-security-policy"] = _PAGE
            await send(message)

        try:
            app = self._refusal(scope, owner) or self.app
            await app(scope, receive, answer)
        finally:
            seconds = time.perf_counter() - begun
            route = getattr(scope.get("route"), "path", "none")
            self.metrics.answered(scope["method"], route, status, seconds)
            _log.info(
                "%s %s %d",
                scope["method"],
                scope["path"],
                status,
                extra={
                    "fields": {
                        "request_id": request_id,
                        "method": scope["method"],
                        "path": scope["path"],
                        "status": status,
                        "milliseconds": round(1000 * seconds, 1),
                        "key": owner,
                    }
                },
            )

    def _refusal(self, scope: Scope, owner: str | None) -> ASGIApp | None:
        """The answer to a request that no route is to see."""
        size = sum(len(name) + len(value) for name, value in scope["headers"])
        if size > HEADER_LIMIT:
            return problem(431, f"Expected headers of at most {HEADER_LIMIT} bytes, got {size}. Send less in them.")
        host = Headers(scope=scope).get("host", "")
        if self.hosts and re.sub(r":\d*$", "", host.lower()) not in self.hosts:
            return problem(
                421,
                f"Expected Host to be {' or '.join(self.hosts)}, got {host[:100]!r}: without an API key the service "
                "answers to its own names only. Use one of them, or set BRDF_API_KEYS.",
            )
        if self.settings.api_keys and owner is None and not _open(scope["path"]):
            return problem(
                401,
                "Expected a known API key. Send it as the header Authorization: Bearer KEY.",
                headers={"www-authenticate": "Bearer"},
            )
        return None


def _open(path: str) -> bool:
    """Whether anybody may ask for it."""
    return path in OPEN or path.startswith(PAGE)
