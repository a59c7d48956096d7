"""Clients of the service, one that waits and one to await; they need httpx2 and pydantic, neither torch nor brdfcore.

with Client("http://127.0.0.1:8000") as client:
    fit = client.fit("garnet_red.brdf", model="lambert + kurt", quantity="brdf")
    print(fit.report())
    print(client.albedo("lambert + kurt", [0, 60, 89]).values)

Every request can be sent again without doing anything twice, and is, where the service is busy or does not answer:
after the time that it names in Retry-After, else after a pause that doubles.
"""

from .awaiting import AsyncClient
from .batches import AsyncBatchResult, BatchResult
from .errors import (
    ClientError,
    FitFailedError,
    FitUnfinishedError,
    JobFailedError,
    JobUnfinishedError,
    ProblemError,
    UnreachableError,
    WaitError,
)
from .fits import AsyncFitResult, ExportedFile, FitResult
from .renders import AsyncRenderResult, RenderResult
from .requests import Declared, Directions, FitOptions, RenderOptions
from .tables import AsyncTableResult, TableResult
from .waiting import Client

__all__ = [
    "AsyncBatchResult",
    "AsyncClient",
    "AsyncFitResult",
    "AsyncRenderResult",
    "AsyncTableResult",
    "BatchResult",
    "Client",
    "ClientError",
    "Declared",
    "Directions",
    "ExportedFile",
    "FitFailedError",
    "FitOptions",
    "FitResult",
    "FitUnfinishedError",
    "JobFailedError",
    "JobUnfinishedError",
    "ProblemError",
    "RenderOptions",
    "RenderResult",
    "TableResult",
    "UnreachableError",
    "WaitError",
]
