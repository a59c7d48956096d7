"""Tables of albedos on the service, as the clients hand them out."""

from ..schemas import ProgressView, TableOutcome, TableView
from .calls import Call, content
from .errors import JobUnfinishedError
from .jobs import Awaited, Job, Waiting


class _Table(Job[TableView]):
    """A table of albedos on the service."""

    _path, _name = "/v1/albedo", "table"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.id}, {self.view.request.material!r}, {self.job_status})"

    @property
    def result(self) -> TableOutcome:
        """What the table is: its axes, its error, whether that meets the tolerance, and what it cost."""
        if self.view.result is None:
            raise JobUnfinishedError(self._unfinished())
        return self.view.result

    def _numbers(self, kind: str) -> Call[bytes]:
        accept = {"npz": "application/x-npz", "json": "application/json"}[kind]
        return (yield from content("GET", f"{self._path}/{self.id}/table", headers={"accept": accept}))


class TableResult(_Table, Waiting[TableView, ProgressView]):
    """A table of albedos on the service."""

    def content(self, kind: str = "npz") -> bytes:
        """The table's numbers as the bytes of an npz or JSON file, which brdfcore.AlbedoTable.load reads."""
        return self._run(self._numbers(kind))


class AsyncTableResult(_Table, Awaited[TableView, ProgressView]):
    """The same, to be awaited."""

    async def content(self, kind: str = "npz") -> bytes:
        """The table's numbers as the bytes of an npz or JSON file, which brdfcore.AlbedoTable.load reads."""
        return await self._run(self._numbers(kind))
