"""Fits of materials to measured samples."""

from ._fit import Progress, fit
from .asked import check
from .batch import fit_batch
from .every_error import errors
from .losses import LOSSES
from .plan import OPTIMIZERS
from .result import Cost, Fit
from .robust import ROBUST
from .rung import Rung
from .support import Support, supports

__all__ = [
    "LOSSES",
    "OPTIMIZERS",
    "ROBUST",
    "Cost",
    "Fit",
    "Progress",
    "Rung",
    "Support",
    "check",
    "errors",
    "fit",
    "fit_batch",
    "supports",
]
