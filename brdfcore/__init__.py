"""Analyse and fit surface reflectance: differentiable BRDF models, true sampling, fits with honest intervals.

import brdfcore as bc

samples = bc.read("garnet_red.brdf")
fit = bc.fit(samples, "lambert + kurt")
print(fit.report())
bc.plots.save(bc.plots.lobes(fit.material, samples), "garnet_red.svg")
"""

from importlib.metadata import version

__version__ = version("brdfcore")

from . import errors, plots
from .fitting import LOSSES, OPTIMIZERS, Fit, Progress, fit
from .formats import FORMATS, read
from .formats.samples import QUANTITIES, Samples
from .models import MODELS, Model
from .models.material import Material, material

__all__ = [
    "FORMATS",
    "LOSSES",
    "MODELS",
    "OPTIMIZERS",
    "QUANTITIES",
    "Fit",
    "Material",
    "Model",
    "Progress",
    "Samples",
    "__version__",
    "errors",
    "fit",
    "material",
    "plots",
    "read",
]
