"""Fits that were submitted together, as the clients hand them out."""

from collections.abc import Callable
from typing import Self

from ..schemas import BatchRow, BatchTable, BatchView
from .calls import Call, content, read, watched
from .jobs import Awaited, Kept, Waiting


class _Batch(Kept[BatchView, BatchView]):
    """Fits that were submitted together."""

    _path = "/v1/batches"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.id}, {dict(self.view.counts)})"

    def _finished(self, timeout: float | None, progress: Callable[[BatchView], None] | None) -> Call[Self]:
        tell = progress or (lambda now: None)
        self.view = yield from watched(f"{self._path}/{self.id}", self.view, lambda now: now.finished, timeout, tell)
        return self

    def _rows(self) -> Call[list[BatchRow]]:
        return (yield from read(BatchTable, "GET", f"{self._path}/{self.id}/table")).rows

    def _csv(self) -> Call[str]:
        path = f"{self._path}/{self.id}/table"
        return (yield from content("GET", path, headers={"accept": "text/csv"})).decode()


class BatchResult(_Batch, Waiting[BatchView, BatchView]):
    """Fits that were submitted together."""

    def rows(self) -> list[BatchRow]:
        """Its fits as they stand, in the order of datasets, then of models."""
        return self._run(self._rows())

    def csv(self) -> str:
        """The same as a CSV file."""
        return self._run(self._csv())


class AsyncBatchResult(_Batch, Awaited[BatchView, BatchView]):
    """The same, to be awaited."""

    async def rows(self) -> list[BatchRow]:
        """Its fits as they stand, in the order of datasets, then of models."""
        return await self._run(self._rows())

    async def csv(self) -> str:
        """The same as a CSV file."""
        return await self._run(self._csv())
