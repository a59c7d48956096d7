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
    from . import bounds, energy, errors, hard_cases, plots, render, sampling, study
    from .energy.albedo import Albedo, albedo
    from .energy.certificate import Certificate, certify
    from .energy.hemispherical import hemispherical_albedo
    from .energy.tables import AlbedoTable, albedo_table
    from .fitting import LOSSES, OPTIMIZERS, ROBUST, Fit, Progress, fit, fit_batch
    from .formats import FORMATS, read
    from .formats.samples import QUANTITIES, Samples
    from .models import MODELS, Model
    from .models.material import Material, material
    from .models.presets import PRESETS, Preset

__version__ = version("brdfcore")

__all__ = [
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
    "Fit",
    "Material",
    "Model",
    "Preset",
    "Progress",
    "Samples",
    "__version__",
    "albedo",
    "albedo_table",
    "bounds",
    "certify",
    "energy",
    "errors",
    "fit",
    "fit_batch",
    "hard_cases",
    "hemispherical_albedo",
    "material",
    "plots",
    "read",
    "render",
    "sampling",
    "study",
]

_MODULES = {
    ".energy.albedo": ("Albedo", "albedo"),
    ".energy.certificate": ("Certificate", "certify"),
    ".energy.hemispherical": ("hemispherical_albedo",),
    ".energy.tables": ("AlbedoTable", "albedo_table"),
    ".fitting": ("LOSSES", "OPTIMIZERS", "ROBUST", "Fit", "Progress", "fit", "fit_batch"),
    ".formats": ("FORMATS", "read"),
    ".formats.samples": ("QUANTITIES", "Samples"),
    ".models": ("MODELS", "Model"),
    ".models.material": ("Material", "material"),
    ".models.presets": ("PRESETS", "Preset"),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> object:
    if name in ("bounds", "energy", "errors", "hard_cases", "plots", "render", "sampling", "study"):
        return importlib.import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name], __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
