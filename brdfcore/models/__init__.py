"""The models, by name: one file a lobe or diffuse term."""

from .ashikhmin_premoze import AshikhminPremoze
from .ashikhmin_shirley import AshikhminShirley
from .ashikhmin_shirley_diffuse import AshikhminShirleyDiffuse
from .base import Model
from .beckmann import Beckmann
from .blinn_phong import BlinnPhong
from .cook_torrance import CookTorrance
from .coupled_lambert import CoupledLambert
from .edwards import Edwards
from .ggx import Ggx
from .kurt import Kurt
from .kurt_plausible import KurtPlausible
from .lafortune import Lafortune
from .lambert import Lambert
from .oren_nayar import OrenNayar
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
        OrenNayar,
        Ward,
        WardDuer,
        WardNeumann,
        WardBounded,
        AshikhminShirley,
        Kurt,
        KurtPlausible,
        BlinnPhong,
        CookTorrance,
        Lafortune,
        AshikhminPremoze,
        Edwards,
        Ggx,
        Beckmann,
    )
}

__all__ = ["MODELS", "Model"]
