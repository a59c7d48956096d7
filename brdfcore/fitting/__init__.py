"""Fits of materials to measured samples."""

from ._fit import Progress, errors, fit
from .losses import LOSSES
from .plan import OPTIMIZERS, check
from .result import Cost, Fit

__all__ = ["LOSSES", "OPTIMIZERS", "Cost", "Fit", "Progress", "check", "errors", "fit"]
