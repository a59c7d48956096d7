"""The Smith microfacet lobes and the exact Fresnel reflectance in textbook form, to 60 digits.

Like reference.py, which takes the tables in: written from the equations, exact on the components as they are stored,
h.wo the mean of h.wi and h.wo, and each value with its exponent Q.
"""

from collections.abc import Callable, Mapping, Sequence

import mpmath

mp = mpmath.mp.clone()
mp.dps = 60

Vector = Sequence[mpmath.mpf]
Numbers = Mapping[str, mpmath.mpf]


def exact_fresnel(cosine: mpmath.mpf, index: mpmath.mpf | mpmath.mpc) -> mpmath.mpf:
    """Fresnel's equations with Snell's law (Born and Wolf, eqs. 1.5.21a), unpolarised, index eta or eta + i k."""
    transmitted = mp.sqrt(mp.mpc(1 - (1 - cosine**2) / index**2))
    rs = (cosine - index * transmitted) / (cosine + index * transmitted)
    rp = (index * cosine - transmitted) / (index * cosine + transmitted)
    return (abs(rs) ** 2 + abs(rp) ** 2) / 2


def fresnel(v: Numbers, cosine: mpmath.mpf) -> mpmath.mpf:
    """The factor that the given parameters make: conductor, dielectric, Schlick's, or 1."""
    if "eta" in v:
        return exact_fresnel(cosine, mp.mpc(v["eta"], v.get("k", 0)))
    return v["f0"] + (1 - v["f0"]) * max(1 - cosine, mp.mpf(0)) ** 5 if "f0" in v else mp.mpf(1)


def widths(v: Numbers) -> tuple[mpmath.mpf, mpmath.mpf]:
    return (v["a"], v["a"]) if "a" in v else (v["ax"], v["ay"])


def half(wi: Vector, wo: Vector) -> tuple[list[mpmath.mpf], mpmath.mpf]:
    """The unit half vector, and its mean cosine with the two directions."""
    h = [a + b for a, b in zip(wi, wo, strict=True)]
    norm = mp.sqrt(sum(c * c for c in h))
    h = [c / norm for c in h]
    return h, sum(c * (a + b) for c, a, b in zip(h, wi, wo, strict=True)) / 2


def tangent2(v: Numbers, h: Vector) -> mpmath.mpf:
    """tan^2 theta_h (cos^2 phi_h / ax^2 + sin^2 phi_h / ay^2)."""
    ax, ay = widths(v)
    return ((h[0] / ax) ** 2 + (h[1] / ay) ** 2) / h[2] ** 2


def ggx_d(v: Numbers, h: Vector) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Heitz 2014, eq. 85; Walter et al. 2007, eq. 33."""
    ax, ay = widths(v)
    return 1 / (mp.pi * ax * ay * h[2] ** 4 * (1 + tangent2(v, h)) ** 2), mp.mpf(0)


def beckmann_d(v: Numbers, h: Vector) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Heitz 2014, eq. 83; Walter et al. 2007, eq. 25."""
    ax, ay = widths(v)
    q = tangent2(v, h)
    return mp.exp(-q) / (mp.pi * ax * ay * h[2] ** 4), q


def ggx_lambda(a: mpmath.mpf) -> mpmath.mpf:
    """Heitz 2014, eq. 72, of a = 1 / (alpha tan theta)."""
    return (mp.sqrt(1 + 1 / a**2) - 1) / 2


def beckmann_lambda(a: mpmath.mpf) -> mpmath.mpf:
    """Heitz 2014, eq. 68."""
    return (mp.erf(a) - 1) / 2 + mp.exp(-(a**2)) / (2 * a * mp.sqrt(mp.pi))


Distribution = Callable[[Numbers, Vector], tuple[mpmath.mpf, mpmath.mpf]]
Lambda = Callable[[mpmath.mpf], mpmath.mpf]


def masked(lambda_: Lambda, v: Numbers, w: Vector) -> mpmath.mpf:
    """Lambda of a direction (Heitz 2014, eqs. 80, 84, 86)."""
    ax, ay = widths(v)
    tangent = mp.sqrt((ax * w[0]) ** 2 + (ay * w[1]) ** 2) / w[2]
    return lambda_(1 / tangent) if tangent else mp.mpf(0)


def g2(lambda_: Lambda, v: Numbers, wi: Vector, wo: Vector, *, separable: bool = False) -> mpmath.mpf:
    """Heitz 2014, eqs. 98, 99."""
    i, o = masked(lambda_, v, wi), masked(lambda_, v, wo)
    return 1 / ((1 + i) * (1 + o)) if separable else 1 / (1 + i + o)


def _value(distribution: Distribution, lambda_: Lambda, *, separable: bool = False) -> Callable[..., tuple]:
    """Walter et al. 2007, eq. 20, times ks."""

    def formula(v: Numbers, wi: Vector, wo: Vector) -> tuple[mpmath.mpf, mpmath.mpf]:
        h, cosine = half(wi, wo)
        d, q = distribution(v, h)
        shadowing = g2(lambda_, v, wi, wo, separable=separable)
        return v["ks"] * fresnel(v, cosine) * d * shadowing / (4 * wi[2] * wo[2]), q

    return formula


def _density(distribution: Distribution, lambda_: Lambda) -> Callable[..., mpmath.mpf]:
    """Heitz and d'Eon 2014: G1(wo) (wo.h) D / co over the half vectors, times 1 / (4 wo.h)."""

    def formula(v: Numbers, wi: Vector, wo: Vector) -> mpmath.mpf:
        h, cosine = half(wi, wo)
        visible = cosine * distribution(v, h)[0] / (wo[2] * (1 + masked(lambda_, v, wo)))
        return visible / (4 * cosine)

    return formula


VALUE: dict[str, Callable[..., tuple[mpmath.mpf, mpmath.mpf]]] = {
    "ggx": _value(ggx_d, ggx_lambda),
    "ggx(separable)": _value(ggx_d, ggx_lambda, separable=True),
    "beckmann": _value(beckmann_d, beckmann_lambda),
    "beckmann(separable)": _value(beckmann_d, beckmann_lambda, separable=True),
}

DENSITY: dict[str, Callable[..., mpmath.mpf]] = {
    "ggx": _density(ggx_d, ggx_lambda),
    "beckmann": _density(beckmann_d, beckmann_lambda),
}

# By how much roundings of the directions are amplified. Rounding turns the half vector by eps / |wi + wo|. The other
# lobes hide that in derivatives as large as f / (ci + co), or in a distribution that is 0 where it would show.
CONDITION: dict[str, Callable[..., mpmath.mpf]] = {"ggx(separable)": lambda v, wi, wo: 1 / half(wi, wo)[1]}
