"""Mitsuba 3: a Python file that registers a BSDF which is this material, with its own sampling; needs no brdfcore.

In Mitsuba `si.wi` is the side that rays come from, the viewer, which is wo here; `wo` is the side that is sampled, wi
here; and its `eval` includes the cosine of the latter. The file's arithmetic is that of the library's equations
(_terms.py), in the precision of Mitsuba's variant; every value is a differentiable scene parameter. Beckmann's lobe is
sampled by all of its normals, not by the visible ones.
Source: Mitsuba 3.9, "Custom plugins"; checked by running it (tests/exports/test_mitsuba_export.py).
"""

from ..models.material import Material
from ._difference import difference
from ._export import Export, Exporter, Orientation, comment
from ._language import number
from ._shader import Shader

_HEAD = """
import math

import drjit as dr
import mitsuba as mi

{check}PI = math.pi
exp, log, sqrt, sin, cos, erf = dr.exp, dr.log, dr.sqrt, dr.sin, dr.cos, dr.erf
pow, atan, max, min, choose = dr.power, dr.atan2, dr.maximum, dr.minimum, dr.select
vec3 = mi.Color3f


"""
_CHECK = """if "_rgb" not in (mi.variant() or ""):
    raise ImportError(f"Expected a variant with RGB colours, got {mi.variant()}. Call mi.set_variant('llvm_ad_rgb').")

"""
_CLASS = '''

class {class_name}(mi.BSDF):
    """The material {name}: front side only."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.values = {{
{values}
        }}
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide{anisotropic}
        self.m_components = [flags]
        self.m_flags = flags

    def sample(self, ctx, si, sample1, sample2, active=True):
        wo = si.wi
        bs = mi.BSDFSample3f()
        bs.wo = mi.Vector3f(*draw(wo.x, wo.y, wo.z, sample1, sample2.x, sample2.y, self.values))
        bs.pdf = self.pdf(ctx, si, bs.wo, active)
        bs.eta = 1.0
        bs.sampled_type = +mi.BSDFFlags.GlossyReflection
        bs.sampled_component = 0
        drawn = bs.pdf > 0.0
        weight = self.eval(ctx, si, bs.wo, active) / dr.select(drawn, bs.pdf, 1.0)
        return bs, dr.select(drawn, weight, mi.Spectrum(0.0))

    def eval(self, ctx, si, wo, active=True):
        above = (si.wi.z > 0.0) & (wo.z > 0.0) & active
        f = brdf(wo.x, wo.y, wo.z, si.wi.x, si.wi.y, si.wi.z, self.values)
        return dr.select(above, mi.Spectrum(f * wo.z), mi.Spectrum(0.0))

    def pdf(self, ctx, si, wo, active=True):
        above = (si.wi.z > 0.0) & (wo.z > 0.0) & active
        return dr.select(above, density(wo.x, wo.y, wo.z, si.wi.x, si.wi.y, si.wi.z, self.values), 0.0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def traverse(self, cb):
        for name, value in self.values.items():
            cb.put(name, value, mi.ParamFlags.Differentiable)

    def to_string(self):
        return "{class_name}[{name}]"


mi.register_bsdf("{name}", lambda props: {class_name}(props))
'''


def write(material: Material, name: str, orientation: Orientation | None) -> Export:
    """The plugin's source, which registers the BSDF under the identifier; for one channel or three."""
    shader = Shader(material)
    found = difference(material, shader.f)
    holds = f'Mitsuba 3 plugin: run it after mi.set_variant(...), then use {{"type": "{name}"}}.'
    values = "\n".join(
        f'            "{key}": {number(value) if isinstance(value, list) else f"mi.Float({number(value)})"},'
        for key, value in shader.values.items()
    )
    anisotropic = any("anisotropic" in term.model.options for term in material.form.terms)
    parts = {
        "name": name,
        "class_name": "".join(word.capitalize() for word in name.split("_")),
        "values": values,
        "anisotropic": " | mi.BSDFFlags.Anisotropic" if anisotropic else "",
    }
    text = comment(material, holds, found, "#") + _HEAD.format(check=_CHECK if shader.coloured else "")
    return Export("mitsuba", text + shader.python() + _CLASS.format(**parts), found, holds)


EXPORT = Exporter(
    name="mitsuba",
    description="Mitsuba 3 plugin, a Python file of its own; exact for every model but compensated lobes",
    suffix=".py",
    media_type="text/x-python",
    write=write,
)
