"""What a client asks, as steps that know nothing of the network: both clients take them, one waiting, one awaiting.

A call is a generator. It yields what to ask, or how long to pause, is sent the answer, and returns its result.
"""

import time
from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

from pydantic import BaseModel, ValidationError

from ..schemas import FINISHED, JobView, ProgressView
from .errors import JobFailedError, UnreachableError, WaitError


@dataclass(frozen=True)
class Ask:
    """A request; all of them can be sent twice without doing anything twice."""

    method: str
    path: str
    what: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Pause:
    """So many seconds in which nothing is asked."""

    seconds: float


_T = TypeVar("_T")
_View = TypeVar("_View", bound=BaseModel)
_Job = TypeVar("_Job", bound=JobView)
Call = Generator[Ask | Pause, Any, _T]
Tell = Callable[[ProgressView], None]


class Run(Protocol):
    """Takes the steps of a call and gives its result."""

    def __call__(self, call: Call[_T]) -> _T:
        """The result."""


class Start(Protocol):
    """The same, to be awaited."""

    def __call__(self, call: Call[_T]) -> Coroutine[Any, Any, _T]:
        """The result."""


def read(view: type[_View], method: str, path: str, **what: Any) -> Call[_View]:
    """What the service answers, as a view; UnreachableError where something else answers."""
    answer = yield Ask(method, path, what)
    try:
        return view.model_validate_json(answer.content)
    except ValidationError:
        raise UnreachableError(
            f"Expected an answer of this service at {answer.url}, got something else. Check the URL, and that client "
            "and service are of one version."
        ) from None


def answered(method: str, path: str, **what: Any) -> Call[Any]:
    """The answer itself, where its headers count."""
    return (yield Ask(method, path, what))


def content(method: str, path: str, **what: Any) -> Call[bytes]:
    """The bytes that the service answers."""
    answer = yield Ask(method, path, what)
    return bytes(answer.content)


def watched(
    path: str, view: _View, over: Callable[[_View], bool], timeout: float | None, tell: Callable[[_View], None]
) -> Call[_View]:
    """The view of that path once it is over, which `tell` hears each time; WaitError after `timeout` s."""
    begun = time.monotonic()
    while True:
        tell(view)
        if over(view):
            return view
        waited = time.monotonic() - begun
        if timeout is not None and waited >= timeout:
            raise WaitError(
                f"Expected {path} to be finished within {timeout:.3g} s, but it is not. Wait on, or cancel it."
            )
        yield Pause(min(max(waited / 10, 0.05), 1.0))
        view = yield from read(type(view), "GET", path)


def finished(
    path: str, job: _Job, name: str, failed: type[JobFailedError], timeout: float | None, progress: Tell | None
) -> Call[_Job]:
    """The job, succeeded; raises `failed` if it ends otherwise, WaitError after `timeout` s."""
    told: ProgressView | None = None

    def tell(now: _Job) -> None:
        nonlocal told
        if progress is not None and now.progress is not None and now.progress != told:
            told = now.progress
            progress(told)

    job = yield from watched(f"{path}/{job.id}", job, lambda now: now.status in FINISHED, timeout, tell)
    if job.status != "succeeded":
        raise failed(job.error or f"The {name} {job.id} was cancelled.")
    return job
