"""The largest f cos theta_o over all directions into a box: for renderers that cull, and for rejection sampling."""

from .search import TOLERANCE, maximum
from .terms import BOUNDS

__all__ = ["BOUNDS", "TOLERANCE", "maximum"]
