"""The ASGI application, and the server around it."""

import contextlib
import functools
import json
import logging
import time
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import uvicorn
from fastapi import FastAPI
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.types import ASGIApp

import brdfcore as bc

from . import disk, errors, examples, log
from .datasets import Datasets
from .guard import Guard
from .jobs.dispatcher import Dispatcher
from .jobs.runner import LocalRunner, Runner
from .jobs.store import JobStore
from .metrics import Metrics
from .routes import ROUTERS
from .settings import Settings
from .state import State

_log = logging.getLogger("service")
_JOBS = "jobs.sqlite3"
_LARGE = 2**14  # bytes from which an answer is compressed for who admits it
_PACKED = (*DEFAULT_EXCLUDED_CONTENT_TYPES, "application/x-npz", "application/x-npy", "application/octet-stream")


def _runner(settings: Settings) -> Runner:
    """What computes: this machine's processes, or a Ray cluster where one is named."""
    if not settings.ray_address:
        return LocalRunner(settings.data, settings.fit_memory)
    from .jobs.ray_runner import RayRunner  # a cluster is rarely there, and Ray is heavy

    return RayRunner(
        settings.ray_address, settings.data, settings.fit_memory, cpus=settings.ray_cpus, gpus=settings.ray_gpus
    )


class _App(FastAPI):
    """An application inside the guard, whose 500s carry what every answer does."""

    def openapi(self) -> dict[str, Any]:
        """The OpenAPI document, with an example for every operation."""
        if self.openapi_schema is None:
            self.openapi_schema = examples.shown(super().openapi())
        return self.openapi_schema

    def build_middleware_stack(self) -> ASGIApp:
        """The application that the server calls."""
        return Guard(super().build_middleware_stack(), self.state.settings, self.state.metrics, self.state.hosts)


def create_app(settings: Settings | None = None, runner: Runner | None = None) -> FastAPI:
    """The application; while it runs, so do its fits. Without settings the environment's hold, and name the runner."""
    chosen = settings or Settings.from_environment()
    metrics = Metrics()

    @contextlib.asynccontextmanager
    async def running(app: FastAPI) -> AsyncIterator[None]:
        datasets = Datasets(chosen.data)
        store = JobStore(chosen.data / _JOBS)
        metrics.watch(store)

        def sweep() -> None:
            if chosen.keep_days:
                before = time.time() - 86400 * chosen.keep_days
                jobs, files = store.forget(before), datasets.forget(before, store.asks_for)
                files += disk.forget(chosen.data / "renders", before, functools.partial(store.mentioned, "render"))
                files += disk.forget(chosen.data / "tables", before, functools.partial(store.mentioned, "albedo_table"))
                _log.info("removed %d jobs and %d files older than %g days", jobs, files, chosen.keep_days)

        def ended(job_id: str, reason: str) -> None:
            job = store.get(job_id)
            if job is None:
                return
            if reason:
                metrics.failed(job.kind, reason)
            else:
                request = json.loads(job.request)
                model = request.get("model") or ("several" if request.get("models") else "")
                metrics.succeeded(job.kind, model, (job.finished or 0.0) - (job.started or 0.0))

        dispatcher = Dispatcher(
            store,
            runner or _runner(chosen),
            chosen.data / "lock",
            workers=chosen.workers,
            fit_seconds=chosen.fit_seconds,
            sweep=sweep,
            ended=ended,
        )
        dispatcher.start()
        aside, computing = ThreadPoolExecutor(1, "aside"), ThreadPoolExecutor(1, "computing")
        app.state.service = State(chosen, store, datasets, dispatcher, aside, computing)
        try:
            yield
        finally:
            for pool in (aside, computing):  # who asked for what they do now is gone
                pool.shutdown(wait=False, cancel_futures=True)
            dispatcher.stop()
            store.close()

    summary = "Reflectance models fitted to measurements, with intervals, errors and lobe plots."
    app = _App(
        title="brdfcore", version=bc.__version__, summary=summary, lifespan=running, docs_url=None, redoc_url=None
    )
    app.state.ending, app.state.hosts = lambda: False, ()
    app.state.metrics, app.state.settings = metrics, chosen
    errors.install(app)
    app.add_middleware(
        GZipMiddleware,
        minimum_size=_LARGE,
        compresslevel=5,
        exclude_content_types=_PACKED,  # and never a stream of events
    )
    for router in ROUTERS:
        app.include_router(router)
    return app


def server(settings: Settings) -> uvicorn.Server:
    """A server of the application; told to end, it does so within 5 s, and unfinished fits stay queued.

    Raises InvalidValueError for settings with which it cannot start.
    """
    settings.check_open()
    log.begin(settings.log_level)
    settings.data.mkdir(parents=True, exist_ok=True)
    # what cannot be started says so here in its sentence; once the application starts it would be a traceback
    JobStore(settings.data / _JOBS).close()
    app = create_app(settings, _runner(settings))
    if not settings.api_keys:  # a page of any site may give its name this machine's address, and read as its own
        app.state.hosts = dict.fromkeys((settings.host, "127.0.0.1", "localhost", "[::1]"))
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        timeout_graceful_shutdown=2,
        limit_concurrency=500,
        server_header=False,
        log_config=None,
    )
    made = uvicorn.Server(config)
    app.state.ending = lambda: made.should_exit  # who waits for a fit is answered as things stand
    return made
