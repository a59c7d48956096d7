"""Fits of materials to measured samples."""

from ._fit import Progress, fit
from ._held_out import HeldOut, held_out
from .batch import fit_batch
from .losses import LOSSES
from .plan import OPTIMIZERS, check
from .result import Cost, Fit
from .robust import ROBUST
from .support import Support, supports
from .worth import errors

__all__ = [
    "LOSSES",
    "OPTIMIZERS",
    "ROBUST",
    "Cost",
    "Fit",
    "HeldOut",
    "Progress",
    "Support",
    "check",
    "errors",
    "fit",
    "fit_batch",
    "held_out",
    "supports",
]
