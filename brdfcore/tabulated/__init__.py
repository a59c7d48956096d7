"""Measured BRDFs that are grids, as materials: one file a format that can be evaluated between its nodes."""

from ._tabulated import GRIDDED, Tabulated
from .lawrence import lawrence

__all__ = ["GRIDDED", "Tabulated", "lawrence"]
