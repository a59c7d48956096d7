"""Analyse and fit surface reflectance: differentiable BRDF models, true sampling, fits with honest intervals.

    import brdfcore as bc

    samples = bc.read("garnet_red.brdf")
    fit = bc.fit(samples, "lambert + kurt")
    print(fit.report())
    bc.plots.save(bc.plots.lobes(fit.material, samples), "garnet_red.svg")

The names are loaded when they are first used, so that `brdf --help` and the service's client start without torch.
"""

import importlib
from importlib.metadata import version
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import bounds, energy, errors, hard_cases, plots, sampling, study
    from .energy.albedo import Albedo, albedo
    from .energy.certificate import Certificate, certify
    from .energy.hemispherical import hemispherical_albedo
    from .energy.tables import AlbedoTable, albedo_table
    from .exports import EXPORTS, Export, export
    from .fitting import LOSSES, OPTIMIZERS, ROBUST, Fit, Progress, Rung, Support, fit, fit_batch, supports
    from .fitting.comparison import Comparison, compare
    from .fitting.held_out import HeldOut, held_out
    from .fitting.next_directions import NextDirections, next_directions
    from .formats import FORMATS, read
    from .formats.info import Info, info
    from .formats.samples import QUANTITIES, Samples
    from .models import MODELS, Model
    from .models.material import Material, material
    from .models.presets import PRESETS, Preset
    from .tabulated import Tabulated, lawrence

__version__ = version("brdfcore")

__all__ = [
    "EXPORTS",
    "FORMATS",
    "LOSSES",
    "MODELS",
    "OPTIMIZERS",
    "PRESETS",
    "QUANTITIES",
    "ROBUST",
    "Albedo",
    "AlbedoTable",
    "Certificate",
    "Comparison",
    "Export",
    "Fit",
    "HeldOut",
    "Info",
    "Material",
    "Model",
    "NextDirections",
    "Preset",
    "Progress",
    "Rung",
    "Samples",
    "Support",
    "Tabulated",
    "__version__",
    "albedo",
    "albedo_table",
    "bounds",
    "certify",
    "compare",
    "energy",
    "errors",
    "export",
    "fit",
    "fit_batch",
    "hard_cases",
    "held_out",
    "hemispherical_albedo",
    "info",
    "lawrence",
    "material",
    "next_directions",
    "plots",
    "read",
    "sampling",
    "study",
    "supports",
]

_MODULES = {
    ".energy.albedo": ("Albedo", "albedo"),
    ".energy.certificate": ("Certificate", "certify"),
    ".energy.hemispherical": ("hemispherical_albedo",),
    ".energy.tables": ("AlbedoTable", "albedo_table"),
    ".fitting": (
        "LOSSES",
        "OPTIMIZERS",
        "ROBUST",
        "Fit",
        "Progress",
        "Rung",
        "Support",
        "fit",
        "fit_batch",
        "supports",
    ),
    ".fitting.comparison": ("Comparison", "compare"),
    ".fitting.held_out": ("HeldOut", "held_out"),
    ".fitting.next_directions": ("NextDirections", "next_directions"),
    ".exports": ("EXPORTS", "Export", "export"),
    ".formats": ("FORMATS", "read"),
    ".formats.info": ("Info", "info"),
    ".formats.samples": ("QUANTITIES", "Samples"),
    ".models": ("MODELS", "Model"),
    ".models.material": ("Material", "material"),
    ".models.presets": ("PRESETS", "Preset"),
    ".tabulated": ("Tabulated", "lawrence"),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> object:
    if name in ("bounds", "energy", "errors", "hard_cases", "plots", "sampling", "study"):
        return importlib.import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
