"""The ASGI application, and the server around it."""

import contextlib
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor

import uvicorn
from fastapi import FastAPI

import brdfcore as bc

from . import errors
from .datasets import Datasets
from .jobs.dispatcher import Dispatcher
from .jobs.runner import LocalRunner
from .jobs.store import JobStore
from .routes import ROUTERS
from .settings import Settings
from .state import State


def create_app(settings: Settings | None = None) -> FastAPI:
    """The application; while it runs, so do its fits. Without settings the environment's hold."""
    chosen = settings or Settings.from_environment()

    @contextlib.asynccontextmanager
    async def running(app: FastAPI) -> AsyncIterator[None]:
        datasets = Datasets(chosen.data)
        store = JobStore(chosen.data / "jobs.sqlite3")
        runner = LocalRunner(chosen.data, chosen.fit_memory)
        dispatcher = Dispatcher(
            store, runner, chosen.data / "lock", workers=chosen.workers, fit_seconds=chosen.fit_seconds
        )
        dispatcher.start()
        try:
            with ThreadPoolExecutor(1, "aside") as aside, ThreadPoolExecutor(1, "computing") as computing:
                app.state.service = State(chosen, store, datasets, dispatcher, aside, computing)
                yield
        finally:
            dispatcher.stop()
            store.close()

    summary = "Reflectance models fitted to measurements, with intervals, errors and lobe plots."
    app = FastAPI(title="brdfcore", version=bc.__version__, summary=summary, lifespan=running)
    app.state.ending = lambda: False
    errors.install(app)
    for router in ROUTERS:
        app.include_router(router)
    return app


def server(settings: Settings) -> uvicorn.Server:
    """A server of the application; told to end, it does so within 5 s, and unfinished fits stay queued."""
    app = create_app(settings)
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        timeout_graceful_shutdown=2,
        limit_concurrency=500,
        server_header=False,
        log_level="warning",
    )
    made = uvicorn.Server(config)
    app.state.ending = lambda: made.should_exit  # who waits for a fit is answered as things stand
    return made
