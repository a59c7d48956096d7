"""Figures of materials and fits; matplotlib is loaded with the first one."""

from ._figure import kind_of, save, to_bytes
from .albedo import albedo
from .comparison import comparison
from .contours import contours
from .differences import differences
from .directions import directions
from .lobes import check_scale, lobes
from .residuals import residuals, residuals_of

__all__ = [
    "albedo",
    "check_scale",
    "comparison",
    "contours",
    "differences",
    "directions",
    "kind_of",
    "lobes",
    "residuals",
    "residuals_of",
    "save",
    "to_bytes",
]
