"""Measured BRDFs that are grids, as materials: one file a format that can be evaluated between its nodes."""

from ._tabulated import GRIDDED, Tabulated

__all__ = ["GRIDDED", "Tabulated"]
