"""What the routes of one running app share."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from fastapi import Request

from .datasets import Datasets
from .jobs.dispatcher import Dispatcher
from .jobs.store import JobStore
from .settings import Settings


@dataclass(frozen=True)
class State:
    """The parts behind the routes.

    `aside` is one thread for what takes long: reading uploads, so that memory holds one at a time, and drawing,
    because matplotlib allows no second thread. `computing` is another for what is computed while a request waits.
    """

    settings: Settings
    store: JobStore
    datasets: Datasets
    dispatcher: Dispatcher
    aside: ThreadPoolExecutor
    computing: ThreadPoolExecutor


def state(request: Request) -> State:
    """The state of the app that the request came to."""
    found: State = request.app.state.service
    return found
