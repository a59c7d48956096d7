"""GET /docs: the HTTP interface as a page for people."""

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from ..docs import page
from ._http import require_accepted

router = APIRouter()


@router.get("/docs", include_in_schema=False)
async def docs(request: Request) -> HTMLResponse:
    """Every operation with its fields, an example and what it answers."""
    require_accepted(request, "text/html")
    return HTMLResponse(page(request.app.openapi(), str(request.base_url).rstrip("/")))
