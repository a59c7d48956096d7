"""Distributions of normals, and the lobes of Smith's microfacets, as they are printed."""

from collections.abc import Callable

from . import compensation
from .fresnel import fresnel
from .symbols import Number, Symbols, Values, Vector

Normals = Callable[[Symbols, Number, Number], tuple[Number, Number]]
Masking = Callable[[Symbols, Number], Number]


def gaussian_exponent(s: Symbols, ax: Number, ay: Number) -> Number:
    """tan^2 theta_h (cos^2 phi_h / ax^2 + sin^2 phi_h / ay^2) [1]."""
    over = 1 / ax**2
    return s.tan2_h * s.turned(over, over if ax is ay else 1 / ay**2)


def beckmann_normals(s: Symbols, ax: Number, ay: Number) -> tuple[Number, Number]:
    """Heitz 2014, eq. 83; Walter et al. 2007, eq. 25 [1/sr], and its exponent."""
    q = gaussian_exponent(s, ax, ay)
    return s.math.exp(-q) / (s.math.pi * ax * ay * s.cos_h**4), q


def ggx_normals(s: Symbols, ax: Number, ay: Number) -> tuple[Number, Number]:
    """Heitz 2014, eq. 85; Walter et al. 2007, eq. 33 [1/sr], with no exponential."""
    spread = (1 + gaussian_exponent(s, ax, ay)) ** 2
    return 1 / (s.math.pi * ax * ay * s.cos_h**4 * spread), 0


def ggx_masking(s: Symbols, a: Number) -> Number:
    """Heitz 2014, eq. 72, of a = 1 / (alpha tan theta) [1]."""
    return (s.math.sqrt(1 + 1 / a**2) - 1) / 2


def beckmann_masking(s: Symbols, a: Number) -> Number:
    """Heitz 2014, eq. 68 [1]."""
    return (s.math.erf(a) - 1) / 2 + s.math.exp(-(a**2)) / (2 * a * s.math.pi**0.5)


def masking(s: Symbols, v: Values, of: Masking, w: Vector) -> Number:
    """Lambda of a direction (Heitz 2014, eqs. 80, 84, 86) [1]."""
    return of(s, s.over(1, s.stretched_tangent(w, *_widths(v))))


def _widths(v: Values) -> tuple[Number, Number]:
    return (v["a"], v["a"]) if "a" in v else (v["ax"], v["ay"])


def _value(
    normals: Normals, of: Masking, *, separable: bool = False, table: compensation.Table | None = None
) -> Callable[[Symbols, Values], tuple[Number, Number]]:
    """Walter et al. 2007, eq. 20, times ks; Heitz 2014, eqs. 98, 99; with a table, what it returns as well."""

    def formula(s: Symbols, v: Values) -> tuple[Number, Number]:
        d, q = normals(s, *_widths(v))
        i, o = masking(s, v, of, s.wi), masking(s, v, of, s.wo)
        shadowing = 1 / ((1 + i) * (1 + o)) if separable else 1 / (1 + i + o)
        single = v["ks"] * fresnel(s, v) * d * shadowing / (4 * s.cos_i * s.cos_o)
        if table is None:
            return single, q
        back, q_back = compensation.returned(s, table, v)
        return single + back, s.over(q * single + q_back * back, single + back)

    return formula


def _density(
    normals: Normals, of: Masking, table: compensation.Table | None = None
) -> Callable[[Symbols, Values], Number]:
    """Heitz and d'Eon 2014: G1(wo) (wo.h) D / co over the half vectors, times 1 / (4 wo.h); mixed with a table's."""

    def formula(s: Symbols, v: Values) -> Number:
        g1 = 1 / (1 + masking(s, v, of, s.wo))
        visible = g1 * s.cos_d * normals(s, *_widths(v))[0] / s.cos_o / (4 * s.cos_d)
        return visible if table is None else compensation.mixed(s, table, visible, v["a"])

    return formula


TABLES = {
    "ggx(compensated)": compensation.Table("ggx_correlated", True, compensation.algebraic),
    "ggx(separable, compensated)": compensation.Table("ggx_separable", False, compensation.algebraic),
    "beckmann(compensated)": compensation.Table("beckmann_correlated", True, compensation.gaussian),
    "beckmann(separable, compensated)": compensation.Table("beckmann_separable", False, compensation.gaussian),
}

_LOBES = {"ggx": (ggx_normals, ggx_masking), "beckmann": (beckmann_normals, beckmann_masking)}

VALUE: dict[str, Callable[[Symbols, Values], tuple[Number, Number]]] = {
    **{name: _value(*lobe) for name, lobe in _LOBES.items()},
    **{f"{name}(separable)": _value(*lobe, separable=True) for name, lobe in _LOBES.items()},
    **{
        key: _value(*_LOBES[key.partition("(")[0]], separable=not table.correlated, table=table)
        for key, table in TABLES.items()
    },
}

DENSITY: dict[str, Callable[[Symbols, Values], Number]] = {
    **{name: _density(*lobe) for name, lobe in _LOBES.items()},
    **{key: _density(*_LOBES[key.partition("(")[0]], table) for key, table in TABLES.items()},
}
