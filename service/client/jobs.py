"""What jobs and batches on the service have in common, to wait for or to await."""

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar, Generic, Self, TypeVar

from ..schemas import BatchView, JobStatus, JobView, ProgressView
from .calls import Call, Run, Start, content, finished, read
from .errors import JobFailedError

View = TypeVar("View", bound=JobView | BatchView)
JobOf = TypeVar("JobOf", bound=JobView)
Told = TypeVar("Told")  # what hears of progress is told


class Kept(Generic[View, Told]):
    """What the service keeps under an id."""

    _path: ClassVar[str]
    view: View

    @property
    def id(self) -> str:
        """Its id on the service."""
        return self.view.id

    def _answered(self, method: str, tail: str) -> Call[Self]:
        self.view = yield from read(type(self.view), method, f"{self._path}/{self.id}{tail}")
        return self

    def _removed(self) -> Call[None]:
        yield from content("DELETE", f"{self._path}/{self.id}")

    @abstractmethod
    def _finished(self, timeout: float | None, progress: Callable[[Told], None] | None) -> Call[Self]: ...


class Waiting(Kept[View, Told]):
    """What waits for the service."""

    def __init__(self, run: Run, view: View) -> None:
        self._run = run
        self.view = view

    def refresh(self) -> Self:
        """It as it stands now."""
        return self._run(self._answered("GET", ""))

    def wait(self, timeout: float | None = None, progress: Callable[[Told], None] | None = None) -> Self:
        """A job, succeeded, or JobFailedError; a batch, none of it queued or running; WaitError after `timeout` s."""
        return self._run(self._finished(timeout, progress))

    def cancel(self) -> Self:
        """It, what was not finished cancelled."""
        return self._run(self._answered("POST", "/cancel"))

    def delete(self) -> None:
        """Remove it from the service, a batch with its fits."""
        self._run(self._removed())


class Awaited(Kept[View, Told]):
    """The same, to be awaited."""

    def __init__(self, run: Start, view: View) -> None:
        self._run = run
        self.view = view

    async def refresh(self) -> Self:
        """It as it stands now."""
        return await self._run(self._answered("GET", ""))

    async def wait(self, timeout: float | None = None, progress: Callable[[Told], None] | None = None) -> Self:
        """A job, succeeded, or JobFailedError; a batch, none of it queued or running; WaitError after `timeout` s."""
        return await self._run(self._finished(timeout, progress))

    async def cancel(self) -> Self:
        """It, what was not finished cancelled."""
        return await self._run(self._answered("POST", "/cancel"))

    async def delete(self) -> None:
        """Remove it from the service, a batch with its fits."""
        await self._run(self._removed())


class Job(Kept[JobOf, ProgressView]):
    """A job on the service. `job_status` says how it stands."""

    _name: ClassVar[str]
    _failed: ClassVar[type[JobFailedError]] = JobFailedError

    @property
    def job_status(self) -> JobStatus:
        """queued, running, succeeded, failed or cancelled, as of the last answer."""
        return self.view.status

    @property
    def progress(self) -> ProgressView | None:
        """How far it had come, as of the last answer."""
        return self.view.progress

    @property
    def reused(self) -> str | None:
        """The earlier job of the same work, whose result this is."""
        return self.view.reused

    def _finished(self, timeout: float | None, progress: Callable[[ProgressView], None] | None) -> Call[Self]:
        self.view = yield from finished(self._path, self.view, self._name, self._failed, timeout, progress)
        return self

    def _unfinished(self) -> str:
        return f"Expected {self._name} {self.id} to have succeeded, but it is {self.job_status}. Call wait()."
