"""What a material does with energy: its directional albedo to a stated accuracy, and what rests on it."""

from .albedo import METHODS, Albedo, of_form

__all__ = ["METHODS", "Albedo", "of_form"]
