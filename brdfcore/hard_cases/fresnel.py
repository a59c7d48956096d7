"""The Fresnel factors as they are printed, by the parameters that a model declares."""

from .symbols import Number, Symbols, Values


def exact_fresnel(s: Symbols, cosine: Number, index: Number) -> Number:
    """Fresnel's equations with Snell's law (Born and Wolf, eqs. 1.5.21a), unpolarised, index eta or eta + i k."""
    transmitted = s.math.sqrt(1 - (1 - cosine**2) / index**2)
    rs = (cosine - index * transmitted) / (cosine + index * transmitted)
    rp = (index * cosine - transmitted) / (index * cosine + transmitted)
    return (abs(rs) ** 2 + abs(rp) ** 2) / 2


def schlick(s: Symbols, f0: Number) -> Number:
    """Schlick 1994."""
    return f0 + (1 - f0) * s.positive(1 - s.cos_d) ** 5


def fresnel(s: Symbols, v: Values) -> Number:
    """A conductor's factor, a dielectric's, Schlick's, or 1."""
    if "k" in v:
        return exact_fresnel(s, s.cos_d, s.complex(v["eta"], v["k"]))
    if "eta" in v:
        return exact_fresnel(s, s.cos_d, v["eta"])
    return schlick(s, v["f0"]) if "f0" in v else 1
