"""Every model's equation, density and sampler in the language of _language.py: what generated shaders are made of.

Geometry, all floats: ci, co, the cosines; xi, yi, xo, yo, the horizontal components; p, q, e2, the half vector's slopes
and the sum of their squares; c2 = 1 + e2 = 1/cos^2 theta_h; hz = ci + co; hd = h.wo. A sampler reads xo, yo, co and
u, v in [0, 1) and gives slopes p, q of a half vector, or a direction.

tests/exports/test_terms.py compares each with the model itself.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..errors import InvalidValueError
from ..models import Model

GEOMETRY = ("ci", "co", "xi", "yi", "xo", "yo", "p", "q", "e2", "c2", "hz", "hd")

_GAUSSIAN = "e = exp(-(sq(p / {x}) + sq(q / {y})))\n"
_GAUSSIAN_DENSITY = "e * c2 * sqrt(c2) / (PI * {x} * {y}) / (4.0 * hd)"
_GAUSSIAN_SLOPES = """
r = sqrt(-log(max(1.0 - u, 1e-12)))
t = 2.0 * PI * v
p = {x} * r * cos(t)
q = {y} * r * sin(t)
"""
_POWER = "power = exp(-0.5 * ({x} * sq(p) + {y} * sq(q)) * log1p_over(e2))\n"
_POWER_NORM = "sqrt(({x} + 1.0) * ({y} + 1.0))"
_POWER_SLOPES = """
t = 2.0 * PI * u
a = sqrt({y} + 1.0) * cos(t)
b = sqrt({x} + 1.0) * sin(t)
norm2 = sq(a) + sq(b)
exponent = ({x} * sq(a) + {y} * sq(b)) / norm2
lost = -2.0 * log(max(1.0 - v, 1e-12)) / (exponent + 1.0)
tangent = sqrt(max(choose(lost < 0.001, lost * (1.0 + lost * (0.5 + lost / 6.0)), exp(lost) - 1.0), 0.0) / norm2)
p = tangent * a
q = tangent * b
"""
_COSINE = """
r = sqrt(u)
t = 2.0 * PI * v
x = r * cos(t)
y = r * sin(t)
z = sqrt(1.0 - u)
"""
_GGX_SLOPES = """
x = {x} * xo
y = {y} * yo
over = 1.0 / sqrt(sq(x) + sq(y) + sq(co))
z = co * over
height = (1.0 - u) * (1.0 + z)
radius = sqrt(u * (1.0 + z) * ((sq(x * over) + sq(y * over)) / (1.0 + z) + height))
p = {x} * (x * over + radius * cos(2.0 * PI * v)) / height
q = {y} * (y * over + radius * sin(2.0 * PI * v)) / height
"""
_LAFORTUNE = """
x = cx * xo
y = cy * yo
over = 1.0 / sqrt(sq(x) + sq(y) + sq(co))
rx = x * over
ry = y * over
rz = co * over
height = exp(log(max(1.0 - u, 1e-12)) / (n + 1.0))
sine = sqrt(max((1.0 - height) * (1.0 + height), 0.0))
a = sine * cos(2.0 * PI * v)
b = sine * sin(2.0 * PI * v)
turn = 1.0 / (1.0 + rz)
x = a * (1.0 - rx * rx * turn) - b * rx * ry * turn + height * rx
y = b * (1.0 - ry * ry * turn) - a * rx * ry * turn + height * ry
z = height * rz - a * rx - b * ry
"""
_EDWARDS = "lump = (n + 1.0) / (PI * rx * ry) * pow(max(1.0 - sq(co * p / rx) - sq(co * q / ry), 0.0), n)\n"
_EDWARDS_DENSITY = "lump * sq(co) * c2 / (2.0 * hz)"
_EDWARDS_SLOPES = """
across = sqrt(max(1.0 - exp(log(max(1.0 - u, 1e-12)) / (n + 1.0)), 0.0)) / co
p = rx * across * cos(2.0 * PI * v)
q = ry * across * sin(2.0 * PI * v)
"""
_KURT = _GAUSSIAN + "d = e * sq(c2) / (PI * {x} * {y})\n"
_COEFFICIENT_OF_ALL = ("ks * f0", "ks * (1.0 - f0)")


@dataclass(frozen=True)
class TermSource:
    """A term: f = sum of bases times coefficients after `lines`; `density` after the same lines; and its sampler."""

    lines: str
    bases: tuple[str, ...]
    coefficients: tuple[str, ...]
    density: str
    sampler: str
    by_slopes: bool = True  # whether the sampler gives slopes p, q; else x, y, z


def term_source(model: Model, coloured: frozenset[str] = frozenset()) -> TermSource:
    """The source of a model with its options chosen; `coloured` are its parameters that have a value a channel.

    Raises InvalidValueError for what needs a table: lobes that are `compensated`.
    """
    if "compensated" in model.options:
        raise InvalidValueError(
            f"Expected {model.name} to be single for a shader, got compensated, which needs a table. "
            "Export it as json, merl or radiance, or fit the lobe without it.",
            field="material",
        )
    return _SOURCES[model.name](model, coloured)


def _widths(model: Model) -> dict[str, str]:
    """What {x} and {y} stand for."""
    names = getattr(model, "width_names", ("", ""))
    return {"x": names[0], "y": names[-1]}


def _fresnel(model: Model, coloured: frozenset[str], lobe: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Bases and coefficients of a lobe under the Fresnel factor that the options name."""
    for word, arguments in (("conductor", ("eta", "k")), ("dielectric", ("eta",))):
        if word in model.options:
            if coloured & set(arguments):
                each = (", ".join(f"{a}[{i}]" if a in coloured else a for a in arguments) for i in range(3))
                factor = f"vec3({', '.join(f'{word}(hd, {given})' for given in each)})"
            else:
                factor = f"{word}(hd, {', '.join(arguments)})"
            return (f"({lobe}) * {factor}",), ("ks",)
    if "f0" not in model.parameter:
        return (lobe,), ("ks",)
    coefficients = _COEFFICIENT_OF_ALL if "ks" in model.parameter else ("f0", "(1.0 - f0)")
    return (lobe, f"({lobe}) * schlick(hd)"), coefficients


def _diffuse(basis: str, coefficient: str = "kd") -> Callable[[Model, frozenset[str]], TermSource]:
    return lambda model, coloured: TermSource("", (basis,), (coefficient,), "ci / PI", _COSINE, by_slopes=False)


def _ward(over: str) -> Callable[[Model, frozenset[str]], TermSource]:
    def source(model: Model, coloured: frozenset[str]) -> TermSource:
        w = _widths(model)
        lobe = f"e / (PI * {w['x']} * {w['y']}) * {over}"
        return TermSource(
            _GAUSSIAN.format(**w), (lobe,), ("rs",), _GAUSSIAN_DENSITY.format(**w), _GAUSSIAN_SLOPES.format(**w)
        )

    return source


def _microfacet(lines: str, lobe: str) -> Callable[[Model, frozenset[str]], TermSource]:
    """Lobes of Gaussian slopes under a Fresnel factor."""

    def source(model: Model, coloured: frozenset[str]) -> TermSource:
        w = _widths(model)
        density, sampler = _GAUSSIAN_DENSITY.format(**w), _GAUSSIAN_SLOPES.format(**w)
        return TermSource(lines.format(**w), *_fresnel(model, coloured, lobe.format(**w)), density, sampler)

    return source


def _power(lobe: str) -> Callable[[Model, frozenset[str]], TermSource]:
    """Lobes that are a power of the half vector's height."""

    def source(model: Model, coloured: frozenset[str]) -> TermSource:
        w = _widths(model)
        norm = _POWER_NORM.format(**w)
        bases, coefficients = _fresnel(model, coloured, lobe.format(norm=norm, **w))
        density = f"{norm} / (2.0 * PI) * power / (4.0 * hd)"
        return TermSource(_POWER.format(**w), bases, coefficients, density, _POWER_SLOPES.format(**w))

    return source


def _smith(distribution: str, seen: str) -> Callable[[Model, frozenset[str]], TermSource]:
    """Microfacet lobes; `seen` is B of _smith.py for {z} and the sum of squares s2{side}."""

    def source(model: Model, coloured: frozenset[str]) -> TermSource:
        w = _widths(model)
        lines = distribution.format(**w)
        for side in "io":
            lines += f"s2{side} = sq({w['x']} * x{side}) + sq({w['y']} * y{side})\n"
            lines += seen.format(side=side)
        if "correlated" in model.options:
            lobe = "d / (4.0 * (co * bi + ci * bo))"
        else:
            lobe = "d / (4.0 * (bi + 0.5 * ci) * (bo + 0.5 * co))"
        bases, coefficients = _fresnel(model, coloured, lobe)
        if model.name == "ggx":
            return TermSource(lines, bases, coefficients, "d / (4.0 * (bo + 0.5 * co))", _GGX_SLOPES.format(**w))
        # Beckmann's visible normals need an inversion by steps; all normals, by their slopes, are as true a sampler
        density, sampler = _GAUSSIAN_DENSITY.format(**w), _GAUSSIAN_SLOPES.format(**w)
        return TermSource(lines, bases, coefficients, density, sampler)

    return source


def _oren_nayar(model: Model, coloured: frozenset[str]) -> TermSource:
    dot = "s = xi * xo + yi * yo\n"
    if "qualitative" in model.options:
        lines = dot + "a = 1.0 - 0.5 * sq(sigma) / (sq(sigma) + 0.33)\nb = 0.45 * sq(sigma) / (sq(sigma) + 0.09)\n"
        bases: tuple[str, ...] = ("(a + b * max(s, 0.0) / max(ci, co)) / PI",)
        coefficients: tuple[str, ...] = ("kd",)
    else:
        lines = dot + (
            "r = 2.0 / PI * sigma\nc1 = 1.0 / 2.0 - 2.0 / (3.0 * PI)\nc = c1 - 2.0 / 3.0 + 28.0 / (15.0 * PI)\n"
            "a = 1.0 / (1.0 + c1 * r)\nlost = c * r * a\n"
        )
        bases = (
            "a / PI * max(1.0 + r * choose(s > 0.0, s / max(ci, co), s), 0.0)",
            "a * r / (PI * PI * PI * c) * grooves_lose(ci) * grooves_lose(co)",
        )
        coefficients = ("kd", "kd * kd * (1.0 - lost) / (1.0 - kd * lost)")
    return TermSource(lines, bases, coefficients, "ci / PI", _COSINE, by_slopes=False)


def _lafortune(model: Model, coloured: frozenset[str]) -> TermSource:
    lines = "product = max(cx * xi * xo + cy * yi * yo + ci * co, 0.0)\nalong2 = sq(cx * xo) + sq(cy * yo) + sq(co)\n"
    density = "(n + 1.0) / (2.0 * PI) * pow(product / sqrt(along2), n)"
    return TermSource(lines, ("(n + 2.0) / (2.0 * PI) * pow(product, n)",), ("ks",), density, _LAFORTUNE, False)


def _edwards(model: Model, coloured: frozenset[str]) -> TermSource:
    return TermSource(_EDWARDS, (f"{_EDWARDS_DENSITY} / ci",), ("ks",), _EDWARDS_DENSITY, _EDWARDS_SLOPES)


_SOURCES: Mapping[str, Callable[[Model, frozenset[str]], TermSource]] = {
    "lambert": _diffuse("1.0 / PI"),
    "coupled_lambert": _diffuse("passed(min(hd, 1.0)) / PI", "kd * (1.0 - f0)"),
    "ashikhmin_shirley_diffuse": _diffuse(
        "28.0 / (23.0 * PI) * passed(0.5 * ci) * passed(0.5 * co)", "kd * (1.0 - f0)"
    ),
    "oren_nayar": _oren_nayar,
    "ward": _ward("0.25 / (sqrt(ci) * sqrt(co))"),
    "ward_duer": _ward("0.25 / (ci * co)"),
    "ward_neumann": _ward("0.25 / max(ci, co)"),
    "ward_bounded": _ward("c2 / sq(hz)"),
    "ashikhmin_shirley": _power("{norm} / (8.0 * PI) * power / (hd * max(ci, co))"),
    "kurt": _microfacet(_KURT, "d / (4.0 * hd) * pow(ci * co, -alpha)"),
    "kurt_plausible": _microfacet(_KURT, "d / (4.0 * hd * max(ci, co))"),
    "blinn_phong": _power("({x} + 2.0) / (8.0 * PI) * power"),
    "cook_torrance": _microfacet(_KURT, "0.25 * d * min(1.0 / (ci * co), 4.0 / (hz * c2 * max(ci, co)))"),
    "lafortune": _lafortune,
    "ashikhmin_premoze": _microfacet(_GAUSSIAN, "e * c2 * sqrt(c2) / (PI * {x} * {y}) / (4.0 * (ci + co - ci * co))"),
    "edwards": _edwards,
    "ggx": _smith(
        "d = sq(c2 / (1.0 + sq(p / {x}) + sq(q / {y}))) / (PI * {x} * {y})\n",
        "b{side} = 0.5 * sqrt(sq(c{side}) + s2{side})\n",
    ),
    "beckmann": _smith(
        _KURT,
        "s{side} = sqrt(max(s2{side}, sq(c{side}) / 800.0))\n"
        "b{side} = 0.5 * (c{side} * erf(c{side} / s{side})"
        " + s{side} * exp(-sq(c{side} / s{side})) / 1.7724538509055159)\n",
    ),
}
