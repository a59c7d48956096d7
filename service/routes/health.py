"""Signs of life."""

from fastapi import APIRouter, Request, Response
from fastapi.responses import PlainTextResponse

from ..errors import ProblemError, responses
from ..schemas import HealthView
from ..state import state

router = APIRouter(tags=["health"])


@router.get("/healthz")
async def healthz() -> HealthView:
    """That the process answers."""
    return HealthView(status="ok")


@router.get("/readyz", responses=responses(503))
async def readyz(request: Request) -> HealthView:
    """That fits can be accepted and will run."""
    service = state(request)
    service.store.running()
    if not service.dispatcher.alive:
        raise ProblemError(503, "Expected the dispatcher of fits to run, but it has ended. Restart the service.")
    return HealthView(status="ready")


@router.get("/metrics", response_class=PlainTextResponse)
async def metrics(request: Request) -> Response:
    """Counts in Prometheus's text format: requests, jobs by status, the queue's depth, fit times, failures."""
    return Response(request.app.state.metrics.text(), media_type="text/plain; version=0.0.4; charset=utf-8")
