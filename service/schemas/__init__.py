"""The wire contract: every body that the service reads or writes, one file a resource.

Needs pydantic only, so that clients import it too.
"""

from ._base import DirectionPairs
from .batches import BatchPage, BatchRequest, BatchRow, BatchTable, BatchView
from .datasets import DatasetSamples, DatasetView, FormatList, FormatView, InlineSamples
from .fits import FitPage, FitRequest, FitSummary, FitView, RequestView, SamplesView
from .jobs import FINISHED, JobKind, JobStatus, JobView, ProgressEvent, ProgressView
from .materials import (
    AlbedoRequest,
    AlbedoView,
    EvaluationRequest,
    EvaluationView,
    ModelList,
    ModelView,
    PresetView,
    SphereRequest,
)
from .problems import FieldError, HealthView, Problem
from .renders import EffectView, PlanView, RenderOutcome, RenderPage, RenderRequest, RenderSummary, RenderView
from .results import CertificateView, ComparisonView, CostView, FitOutcome, Interval, OptionsView
from .tables import TableOutcome, TablePage, TableSummary, TableView

__all__ = [
    "FINISHED",
    "AlbedoRequest",
    "AlbedoView",
    "BatchPage",
    "BatchRequest",
    "BatchRow",
    "BatchTable",
    "BatchView",
    "CertificateView",
    "ComparisonView",
    "CostView",
    "DatasetSamples",
    "DatasetView",
    "DirectionPairs",
    "EffectView",
    "EvaluationRequest",
    "EvaluationView",
    "FieldError",
    "FitOutcome",
    "FitPage",
    "FitRequest",
    "FitSummary",
    "FitView",
    "FormatList",
    "FormatView",
    "HealthView",
    "InlineSamples",
    "Interval",
    "JobKind",
    "JobStatus",
    "JobView",
    "ModelList",
    "ModelView",
    "OptionsView",
    "PlanView",
    "PresetView",
    "Problem",
    "ProgressEvent",
    "ProgressView",
    "RenderOutcome",
    "RenderPage",
    "RenderRequest",
    "RenderSummary",
    "RenderView",
    "RequestView",
    "SamplesView",
    "SphereRequest",
    "TableOutcome",
    "TablePage",
    "TableSummary",
    "TableView",
]
