"""What every job shows of itself: its status and how far it is."""

from datetime import datetime
from typing import Literal

from pydantic import Field

from ._base import View

JobKind = Literal["fit", "albedo_table", "render"]


JobStatus = Literal["queued", "running", "succeeded", "failed", "cancelled"]


FINISHED: tuple[JobStatus, ...] = ("succeeded", "failed", "cancelled")


class ProgressView(View):
    """How far a running job is; only a fit has a loss."""

    stage: str
    fraction: float
    loss: float | None


class ProgressEvent(View):
    """How a job stands, as its events tell it."""

    status: JobStatus
    progress: ProgressView | None
    error: str | None
    attempts: int


class JobView(View):
    """What every job shows of itself."""

    id: str
    status: JobStatus
    progress: ProgressView | None
    error: str | None = Field(description="why it failed, in one sentence")
    attempts: int = Field(description="how often it was started")
    reused: str | None = Field(None, description="the earlier job of the same work, whose result this is")
    created: datetime
    started: datetime | None
    finished: datetime | None
