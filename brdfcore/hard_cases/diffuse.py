"""The diffuse terms as they are printed."""

from collections.abc import Callable

from .fresnel import schlick
from .symbols import Number, Symbols, Values


def _lambert(s: Symbols, v: Values) -> tuple[Number, Number]:
    return v["kd"] / s.math.pi, 0


def _coupled_lambert(s: Symbols, v: Values) -> tuple[Number, Number]:
    """Kurt et al. 2010, eq. 13."""
    return v["kd"] * (1 - schlick(s, v["f0"])) / s.math.pi, 0


def _ashikhmin_shirley_diffuse(s: Symbols, v: Values) -> tuple[Number, Number]:
    """Ashikhmin and Shirley 2000, technical report eq. 16."""
    angular = (1 - (1 - s.cos_i / 2) ** 5) * (1 - (1 - s.cos_o / 2) ** 5)
    return 28 * v["kd"] / (23 * s.math.pi) * (1 - v["f0"]) * angular, 0


def oren_nayar(s: Symbols, v: Values) -> tuple[Number, Number]:
    """Oren and Nayar 1994, eq. 30."""
    sigma2 = v["sigma"] ** 2
    a, b = 1 - 0.5 * sigma2 / (sigma2 + 0.33), 0.45 * sigma2 / (sigma2 + 0.09)
    relief = s.relief
    return v["kd"] / s.math.pi * (a + b * s.where_positive(s.level, relief, 0 * relief)), 0


def oren_nayar_energy_preserving(s: Symbols, v: Values) -> tuple[Number, Number]:
    """Portsmouth, Kutz and Hill 2025, listing 1, with the exact directional albedo."""
    r, pi = 2 * v["sigma"] / s.math.pi, s.math.pi
    a = 1 / (1 + (1 / 2 - 2 / (3 * pi)) * r)

    def albedo(mu: Number) -> Number:
        sine = s.sine(mu)
        g = sine * (s.angle(mu) - sine * mu) + 2 * (sine / mu * (1 - sine**3) - sine) / 3
        return a + r * a / pi * g

    level = s.level
    t = s.where_positive(level, level / s.maximum(s.cos_i, s.cos_o), level)
    once = s.where_positive(1 + r * t, 1 + r * t, 0 * t) * v["kd"] / pi * a
    mean = a * (1 + (2 - 28 / (5 * pi)) / 3 * r)
    often = v["kd"] ** 2 * mean / (1 - v["kd"] * (1 - mean)) / pi
    return once + s.over(often * (1 - albedo(s.cos_i)) * (1 - albedo(s.cos_o)), 1 - mean), 0


DIFFUSE: dict[str, Callable[[Symbols, Values], tuple[Number, Number]]] = {
    "lambert": _lambert,
    "coupled_lambert": _coupled_lambert,
    "ashikhmin_shirley_diffuse": _ashikhmin_shirley_diffuse,
    "oren_nayar": oren_nayar,
    "oren_nayar(energy_preserving)": oren_nayar_energy_preserving,
}


def cosine_density(s: Symbols, v: Values) -> Number:
    """The density cos theta_i / pi of every diffuse term's samples [1/sr]."""
    return s.cos_i / s.math.pi
