"""What the quadrature needs to know of each half-vector lobe beside its formula.

`fall`: how it falls with the half vector's slope r: "gaussian" like exp(-(r/w)^2), "power" like (1 + r^2)^(-1/w^2),
"algebraic" like (r/w)^-4, "none". `end`: f cos theta_i goes to 0 at the horizon like an integer power of cos theta_i
(1), like a multiple of a half (2), or like any power (4); `layer`: only where cos theta_i is below the width, by what
is worth its cube. `start`: it has a feature where cos theta_i grows out of
cos theta_o, at r = 1/(T cos phi), T = tan theta_o. `kink`: it has none, one where cos theta_i = cos theta_o ("equal"),
or Cook and Torrance's three ("grooves"). `smith`: its masking has a feature at wi = n, of the width's reciprocal.
"""

from typing import Literal, NamedTuple

import torch
from torch import Tensor

from ..models import Model
from ..parameters import Values


class Profile(NamedTuple):
    """The shape of a lobe, as above."""

    fall: Literal["gaussian", "power", "algebraic", "none"]
    end: Literal[1, 2, 4] = 1
    layer: bool = False
    start: bool = False
    kink: Literal["none", "equal", "grooves"] = "none"
    smith: bool = False


PROFILES = {
    "coupled_lambert": Profile("none"),
    "ward": Profile("gaussian", end=2, start=True),
    "ward_duer": Profile("gaussian"),
    "ward_neumann": Profile("gaussian", kink="equal"),
    "ward_bounded": Profile("gaussian", start=True),
    "ashikhmin_shirley": Profile("power", kink="equal"),
    "kurt": Profile("gaussian", end=4, start=True),
    "kurt_plausible": Profile("gaussian", kink="equal"),
    "blinn_phong": Profile("power"),
    "cook_torrance": Profile("gaussian", kink="grooves"),
    "ashikhmin_premoze": Profile("gaussian", start=True),
    "ggx": Profile("algebraic", end=2, layer=True, start=True, smith=True),
    "beckmann": Profile("gaussian", start=True, smith=True),
}


def slope_widths(model: Model, own: Values) -> tuple[Tensor, Tensor]:
    """The widths of a lobe's slopes along x and along y [1], (R, 1) or (1, 1); those of one without a lobe are 1."""
    profile = PROFILES[model.name]
    if profile.fall == "none":
        one = torch.ones(1, 1, dtype=torch.float64, device=next(iter(own.values())).device)
        return one, one
    along_x, along_y = model.widths(own)  # type: ignore[attr-defined]
    if profile.fall == "power":
        return torch.sqrt(2 / along_x), torch.sqrt(2 / along_y)
    return along_x, along_y


def anisotropic(model: Model) -> bool:
    """Whether the lobe has two widths."""
    return bool(getattr(model, "anisotropic", False))
