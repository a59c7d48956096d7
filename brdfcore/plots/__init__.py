"""Figures of materials and fits; matplotlib is loaded with the first one."""

from ._figure import save, to_bytes
from .lobes import lobes

__all__ = ["lobes", "save", "to_bytes"]
