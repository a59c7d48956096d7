"""Fits of materials to measured samples."""

from ._fit import Progress, fit
from .asked import check
from .batch import fit_batch
from .losses import LOSSES
from .plan import OPTIMIZERS
from .result import Cost, Fit
from .robust import ROBUST
from .rung import Rung
from .worth import errors

__all__ = [
    "LOSSES",
    "OPTIMIZERS",
    "ROBUST",
    "Cost",
    "Fit",
    "Progress",
    "Rung",
    "check",
    "errors",
    "fit",
    "fit_batch",
]
