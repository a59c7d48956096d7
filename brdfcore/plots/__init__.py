"""Figures of materials and fits; matplotlib is loaded with the first one."""

from ._figure import kind_of, save, to_bytes
from .albedo import albedo
from .directions import directions
from .lobes import check_scale, lobes

__all__ = ["albedo", "check_scale", "directions", "kind_of", "lobes", "save", "to_bytes"]
