"""How well a material's own samples serve a renderer."""

from .efficiency import Efficiency, efficiency

__all__ = ["Efficiency", "efficiency"]
