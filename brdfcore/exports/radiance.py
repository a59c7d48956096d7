"""Radiance: `WGMDfunc`, which is `lambert + ward_bounded`, or `ashik2`, whichever comes nearer to other materials.

    WGMDfunc:  f = kd/pi + rs |H|^2 E / (pi ax ay Hz^4)                                       [1/sr]
    ashik2:    f = d/pi (1 - (1 - ci)^5) + (s + (1 - s)(1 - co)^5) L(nu, nv)                  [1/sr]

L is the lobe `ashikhmin_shirley(constant, ks=1)`. Radiance's ashik2 is not the textbook's model: its diffuse term and
its Schlick factor are of one cosine each. The colour of WGMDfunc's lobe is a modifier's, a colorfunc before it. The
orientation is the direction, in the scene's coordinates, whose projection on the surface is the material's x axis.
Materials reflect from the front and transmit nothing.
Source: Radiance 6.0, rt/m_wgmdf.c and rt/ashikhmin.c; values checked by rtrace (tests/exports/test_radiance_export.py).
"""

import functools
import math
import re

import torch
from torch import Tensor

from ..models.form import Form
from ..models.material import Material, material
from ._difference import Nodes, nodes
from ._export import Export, Exporter, Orientation, check_channels, comment
from ._refit import POINTS, Family, Nearest, nearest
from ._symmetry import is_isotropic

_FIELDS = ("lambert.kd", "ward_bounded.rs")
_X_AXIS = (1.0, 0.0, 0.0)


def write(given: Material, name: str, orientation: Orientation | None) -> Export:
    """The scene description's text, for one channel or three; refitted where neither form holds the material."""
    check_channels(given.channels)
    axis = " ".join(map(repr, orientation or _X_AXIS))
    at = nodes(given)
    own = _wgmd_values(given)
    if own is not None:
        body = _wgmd(name, axis, *own)
        holds = "Radiance material WGMDfunc."
        found = at.difference(_f(body, at))
    else:
        few, isotropic = nodes(given, POINTS), is_isotropic(given)
        ward, ashik = nearest(_WARD, few, isotropic), nearest(_ASHIK2, few, isotropic)
        candidates = {
            "WGMDfunc": _wgmd(name, axis, _coloured(ward, 0), _coloured(ward, 1), ward.shape),
            "ashik2": _ashik2(name, axis, ashik),
        }
        differences = {form: at.difference(_f(text, at)) for form, text in candidates.items()}
        form = min(differences, key=lambda form: differences[form])
        body, found = candidates[form], differences[form]
        holds = f"Radiance material {form}, the nearest that Radiance has."
    return Export("radiance", comment(given, holds, found, "#") + body, found, holds)


def _wgmd_values(given: Material) -> tuple[list[float], list[float], tuple[float, float]] | None:
    """What WGMDfunc needs of `lambert`, `ward_bounded` or their sum: kd, rs and widths; None of other materials."""
    form, values = given.form, {key: value.detach() for key, value in given.values().items()}
    names = [term.model.name for term in form.terms]
    if len(set(names)) != len(names) or not set(names) <= {"lambert", "ward_bounded"}:
        return None
    found = {key: form.resolve(key, values) for key in form.all_parameters}
    kd, rs = (found.get(key, torch.zeros(1)).expand(3).tolist() for key in _FIELDS)
    lobe = [float(value) for key, value in found.items() if key.startswith("ward_bounded.a")] or [0.1]
    return kd, rs, (lobe[0], lobe[-1])


def _coloured(member: Nearest, row: int) -> list[float]:
    coefficients: list[float] = member.coefficients[row].expand(3).tolist()
    return coefficients


def _wgmd(name: str, axis: str, kd: list[float], rs: list[float], widths: tuple[float, float]) -> str:
    return (
        f"void colorfunc {name}_specular\n4 {_row(rs)} .\n0\n0\n\n"
        f"void WGMDfunc {name}\n13 {name}_specular 1 {_row(widths)}\n    void 0 0 0\n    void {axis} .\n"
        f"0\n9 {_row(kd)}\n    0 0 0\n    0 0 0\n"
    )


def _ashik2(name: str, axis: str, member: Nearest) -> str:
    colours = f"{_row(_coloured(member, 0))}\n    {_row(_coloured(member, 1))}"
    return f"void ashik2 {name}\n4 {axis} .\n0\n8 {colours}\n    {_row(member.shape)}\n"


def _row(numbers: list[float] | tuple[float, ...]) -> str:
    return " ".join(map(repr, numbers))


def _f(text: str, at: Nodes) -> Tensor:
    """The f [1/sr] at the nodes, (N, 3), of a written material, from its text."""
    numbers = [float(word) for word in re.sub(r"^#.*$", "", text, flags=re.MULTILINE).split() if _is_number(word)]
    with torch.no_grad():
        if re.search(r"^void WGMDfunc ", text, re.MULTILINE):
            # 4 rs rs rs . 0 0 | 13 1 au av 0 0 0 ux uy uz 0 9 kd kd kd 0 0 0 0 0 0
            rs, (au, av), kd = numbers[1:4], numbers[8:10], numbers[18:21]
            made = material(f"lambert(kd={kd}) + ward_bounded(anisotropic, rs={rs}, ax={au!r}, ay={av!r})")
            return made.f(at.wi, at.wo)
        d, s = torch.tensor(numbers[6:12], dtype=torch.float64).reshape(2, 3)
        diffuse, lobe, fresnel = (basis[:, None] for basis in _ashik2_parts(at, (numbers[12], numbers[13])))
        f: Tensor = d * diffuse + (s + (1 - s) * fresnel) * lobe
        return f


def _is_number(word: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", word) is not None


def _ashik2_parts(at: Nodes, shape: tuple[float, float]) -> tuple[Tensor, Tensor, Tensor]:
    """The diffuse term for d = 1, the lobe for s = 1 [1/sr], and Radiance's Schlick s [1], each (N,)."""
    lobe = _lobe("ashikhmin_shirley(anisotropic, constant)", {"ks": 1.0, "nu": shape[0], "nv": shape[1]})
    with torch.no_grad():
        diffuse = (1 - (1 - at.wi[:, 2]) ** 5) / math.pi
        return diffuse, lobe.f(at.wi, at.wo)[:, 0], (1 - at.wo[:, 2]) ** 5


def _ashik2_bases(at: Nodes, shape: tuple[float, float]) -> list[Tensor]:
    diffuse, lobe, fresnel = _ashik2_parts(at, shape)
    return [lobe * fresnel, diffuse, lobe * (1 - fresnel)]


def _ward_bases(at: Nodes, shape: tuple[float, float]) -> list[Tensor]:
    lobe = _lobe("ward_bounded(anisotropic)", {"rs": 1.0, "ax": shape[0], "ay": shape[1]})
    with torch.no_grad():
        f = lobe.f(at.wi, at.wo)[:, 0]
    return [torch.zeros_like(f), torch.full_like(f, 1 / math.pi), f]


def _lobe(text: str, values: dict[str, float]) -> Material:
    """A material of one term with these values."""
    form = _form(text)
    return Material(form, {f"{form.terms[0].label}.{name}": value for name, value in values.items()})


@functools.cache
def _form(text: str) -> Form:
    return material(text).form


_WARD = Family(_ward_bases, (1e-3, 2.0))
_ASHIK2 = Family(_ashik2_bases, (1.0, 1e6))

EXPORT = Exporter(
    name="radiance",
    description="Radiance scene text; exact for lambert + ward_bounded, of others the nearest WGMDfunc or ashik2",
    suffix=".rad",
    media_type="text/plain",
    write=write,
    oriented=True,
)
