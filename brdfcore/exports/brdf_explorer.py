"""Disney's BRDF Explorer: a `.brdf` file, a GLSL shader with the material's values as sliders and colours.

    analytic
    ::begin parameters        float NAME LOW HIGH VALUE    color NAME R G B
    ::begin shader            vec3 BRDF(vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y), without the cosine

L and V leave the surface, X is the material's x axis. The GLSL between the markers needs nothing else, so it serves in
any other shader too, with the parameters as uniforms.
Source: BRDF Explorer, src/brdfs; its arithmetic is that of _terms.py.
"""

from ..models.material import Material
from ._difference import difference
from ._export import Export, Exporter, Orientation, comment
from ._shader import Shader

# GLSL has no error function: Abramowitz and Stegun 1964, 7.1.26, within 1.5e-7
_ERF = """float erf(float x) {
    float t = 1.0 / (1.0 + 0.3275911 * abs(x));
    float a = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    return sign(x) * (1.0 - a * exp(-x * x));
}

"""
_HEAD = """const float PI = 3.14159265358979323846;

float choose(bool condition, float then, float other) {
    return condition ? then : other;
}

"""
_MAIN = """
vec3 BRDF(vec3 L, vec3 V, vec3 N, vec3 X, vec3 Y) {
    if (dot(L, N) <= 0.0 || dot(V, N) <= 0.0) {
        return vec3(0.0);
    }
    return brdf(dot(L, X), dot(L, Y), dot(L, N), dot(V, X), dot(V, Y), dot(V, N));
}
"""


def write(material: Material, name: str, orientation: Orientation | None) -> Export:
    """The file's text, for a material of one channel or three."""
    shader = Shader(material)
    found = difference(material, shader.f)
    holds = "BRDF Explorer shader."
    parameters = []
    for key, parameter in material.form.parameters.items():
        value = shader.values[key.replace(".", "_")]
        variable = key.replace(".", "_")
        if isinstance(value, list):
            parameters.append(f"color {variable} {' '.join(map(repr, value))}")
        else:
            low, high = parameter.search_range
            low, high = min(low, value), max(high, value)
            parameters.append(f"float {variable} {low!r} {high!r} {value!r}")
    code = shader.glsl()
    text = (
        "analytic\n\n"
        + comment(material, holds, found, "#")
        + "\n::begin parameters\n"
        + "\n".join(parameters)
        + "\n::end parameters\n\n::begin shader\n\n"
        + _HEAD
        + (_ERF if "erf(" in code else "")
        + code
        + _MAIN
        + "\n::end shader\n"
    )
    return Export("brdf_explorer", text, found, holds)


EXPORT = Exporter(
    name="brdf_explorer",
    description="BRDF Explorer .brdf, a GLSL shader with sliders; exact for every model but compensated lobes",
    suffix=".brdf",
    media_type="text/plain",
    write=write,
)
