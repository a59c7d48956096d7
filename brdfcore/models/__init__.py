"""The models, by name: one file a lobe or diffuse term."""

from .ashikhmin_shirley import AshikhminShirley
from .ashikhmin_shirley_diffuse import AshikhminShirleyDiffuse
from .base import Model
from .coupled_lambert import CoupledLambert
from .kurt import Kurt
from .kurt_plausible import KurtPlausible
from .lambert import Lambert
from .ward import Ward
from .ward_bounded import WardBounded
from .ward_duer import WardDuer
from .ward_neumann import WardNeumann

MODELS: dict[str, type[Model]] = {
    model.name: model
    for model in (
        Lambert,
        CoupledLambert,
        AshikhminShirleyDiffuse,
        Ward,
        WardDuer,
        WardNeumann,
        WardBounded,
        AshikhminShirley,
        Kurt,
        KurtPlausible,
    )
}

__all__ = ["MODELS", "Model"]
