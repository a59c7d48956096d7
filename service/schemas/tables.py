"""Tables of albedos: what is asked for, and the job that makes one."""

from pydantic import Field

from ._base import View
from .jobs import JobView


class TableRequestView(View):
    """A table's request as it was accepted."""

    material: str
    axes: dict[str, list[float] | None]
    tolerance: float


class AxisView(View):
    """An axis of a table; the names of angles end in _deg, and their ends are in degrees."""

    name: str
    low: float
    high: float
    nodes: int


class TableOutcome(View):
    """A finished table, without its numbers: GET /v1/albedo/{table_id}/table sends those."""

    hash: str = Field(description="of what made it: version, material, axes and tolerance")
    axes: list[AxisView]
    channels: int
    tolerance: float
    error: float = Field(description="claimed, with interpolation, as a share of max(1, albedo)")
    met: bool = Field(description="whether error is at most tolerance")
    evaluations: int
    seconds: float = Field(description="that making it took, once; the same table is not made again")


class TableSummary(JobView):
    """A table's job without its result, as the list shows it."""

    request: TableRequestView


class TableView(TableSummary):
    """A table's job and, once it has succeeded, what came out."""

    result: TableOutcome | None


class TablePage(View):
    """Tables, newest first; `next` is the cursor of the page that follows."""

    items: list[TableSummary]
    next: str | None
