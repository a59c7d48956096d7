"""What every export keeps: files in the registry, comments, and a difference that is what it says it is."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.errors import InvalidValueError, UnknownNameError
from brdfcore.exports import _refit, radiance
from brdfcore.exports._difference import difference, nodes
from brdfcore.exports._symmetry import is_isotropic
from brdfcore.formats import merl

GLOSSY = "lambert(kd=[0.3, 0.2, 0.1]) + ward_bounded(rs=0.1, ax=0.1, ay=0.3)"
EXACT = [
    ("radiance", "lambert(kd=[0.3, 0.2, 0.1]) + ward_bounded(rs=0.1, a=0.1)"),
    ("radiance", GLOSSY),
    ("radiance", "ward_bounded(rs=[0.1, 0.5, 0.9], a=0.02)"),
    ("radiance", "lambert(kd=0.175 - ward_bounded.rs) + ward_bounded(rs=0.05, a=0.03)"),
    ("mitsuba", "lambert + kurt(mx=0.1, my=0.3)"),
    ("brdf_explorer", "lambert + kurt(mx=0.1, my=0.3)"),
    ("json", "lambert + ggx(compensated) + edwards"),
]
REFITTED = [
    "ashikhmin_shirley(n=30) + ashikhmin_shirley_diffuse(kd=[0.1, 0.2, 0.6], f0=ashikhmin_shirley.f0)",
    pytest.param("lambert(kd=0.1) + ggx(a=0.3, ks=[0.5, 0.6, 0.7])", marks=pytest.mark.full),
]


@pytest.fixture
def small_tables(monkeypatch):
    """MERL's dimensions, made small for this test."""
    monkeypatch.setattr(merl, "SHAPE", (45, 30, 60))


def test_every_file_is_in_the_registry():
    folder = Path(radiance.__file__).parent
    assert {path.stem for path in folder.glob("*.py") if path.stem[0] != "_"} == {
        exporter.write.__module__.split(".")[-1] for exporter in bc.EXPORTS.values()
    }
    assert all(name == exporter.name for name, exporter in bc.EXPORTS.items())


@pytest.mark.parametrize(("name", "text"), EXACT)
def test_exact_exports_say_so(name, text):
    material = bc.material(text)
    made = bc.export(material, name)
    assert made.exact
    assert made.difference < 1e-12
    assert "exact: relative RMS difference" in made.content
    assert f"brdfcore {bc.__version__}" in made.content
    unwrapped = re.sub(r"\n[#\s]*", " ", made.content)
    assert str(material) in unwrapped


@pytest.mark.parametrize("text", REFITTED)
def test_a_refits_stated_difference_is_right(text):
    """Within 2 % of an integral over ten times the directions; the bar is 10 %."""
    material = bc.material(text)
    made = bc.export(material, "radiance")
    assert not made.exact
    stated = float(re.search(r"not exact: relative RMS difference of f cos theta_i (\S+)", made.content)[1])
    assert stated == pytest.approx(made.difference, rel=1e-3)
    at = nodes(material, 10 * 2**15, seed=7)
    assert at.difference(radiance._f(made.content, at)) == pytest.approx(made.difference, rel=0.02)


@pytest.mark.parametrize("name", ["radiance", "merl", "mitsuba"])
def test_gray_is_three_equal_channels(name, small_tables):
    """A gray material and the same one in three equal channels are as far from what a file of colours holds."""
    gray = bc.material("lambert(kd=0.1) + kurt(ks=0.6, f0=0.3, m=0.2)")
    coloured = bc.material("lambert(kd=[0.1, 0.1, 0.1]) + kurt(ks=0.6, f0=0.3, m=0.2)")
    expected = bc.export(coloured, name).difference
    assert bc.export(gray, name).difference == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_the_difference_is_its_definition():
    """Against a product rule over the hemispheres, for two smooth materials."""
    ours, other = bc.material("lambert(kd=0.3) + kurt(m=0.6, alpha=0)"), bc.material("lambert(kd=0.4)")
    x, weight = (torch.tensor(a) for a in np.polynomial.legendre.leggauss(24))
    low = math.cos(math.radians(85))
    cosine = low + (1 - low) * (x + 1) / 2
    ci, co, phi = torch.meshgrid(cosine, cosine, torch.arange(32).double() * 2 * math.pi / 32, indexing="ij")
    si, so = torch.sqrt(1 - ci**2), torch.sqrt(1 - co**2)
    wi = torch.stack([si * phi.cos(), si * phi.sin(), ci], -1)
    wo = torch.stack([so, 0 * so, co], -1)
    with torch.no_grad():
        f, g = ours.f(wi, wo)[..., 0], other.f(wi, wo)[..., 0]
    w = weight[:, None, None] * weight[:, None] * ci**2
    expected = math.sqrt(float((w * (g - f) ** 2).sum() / (w * f**2).sum()))
    assert difference(ours, other.f) == pytest.approx(expected, rel=0.02)
    at = nodes(ours)
    mean = float((w * f**2).sum()) / 2 * (1 - low) / 2 * 2 * math.pi / 32  # over wo, of the integral over wi
    assert float((at.weight * at.f[:, 0] ** 2).sum()) == pytest.approx(mean, rel=0.01)


@pytest.mark.parametrize("isotropic", [True, pytest.param(False, marks=pytest.mark.full)])
def test_a_refit_is_the_nearest_of_its_family(isotropic):
    """What is of the family is found again, and no change of it comes nearer."""
    width = "a=0.21" if isotropic else "ax=0.08, ay=0.4"
    material = bc.material(f"lambert(kd=[0.2, 0.5, 0]) + ward_bounded(rs=[0.3, 1, 0.05], {width})")
    found = _refit.nearest(radiance._WARD, nodes(material, _refit.POINTS), isotropic)
    expected = [float(v) for k, v in material.values().items() if ".a" in k for v in [v.detach()]]
    assert found.shape == pytest.approx((expected[0], expected[-1]), rel=2e-3)
    torch.testing.assert_close(
        found.coefficients, torch.tensor([[0.2, 0.5, 0], [0.3, 1, 0.05]], dtype=torch.float64), rtol=0, atol=2e-3
    )


@pytest.mark.parametrize("name", bc.EXPORTS)
def test_a_path_gets_the_content(name, tmp_path, small_tables):
    material = bc.material("lambert(kd=0.3) + ward_bounded(rs=0.1, a=0.4)")
    path = tmp_path / f"7 red paint{bc.EXPORTS[name].suffix}"
    made = bc.export(material, name, path)
    assert made.path == path
    assert path.read_bytes() == made.to_bytes()
    if name in ("radiance", "mitsuba"):
        assert "brdf_7_red_paint" in made.content


def test_a_file_may_be_named_like_a_form_of_radiance(tmp_path):
    material = bc.material("ashikhmin_shirley(n=300)")
    expected = bc.export(material, "radiance")
    assert "void ashik2 brdf\n" in expected.content
    made = bc.export(material, "radiance", tmp_path / "WGMDfunc.rad")
    assert "void ashik2 WGMDfunc\n" in made.content
    assert made.difference == expected.difference


def test_an_orientation_may_be_an_array():
    made = bc.export(ANY, "radiance", orientation=np.array([0, 0.6, 0.8]))
    assert "\n    void 0.0 0.6 0.8 .\n" in made.content


def test_json_reads_back():
    material = bc.material(GLOSSY)
    read = bc.Material.from_json(json.loads(bc.export(material, "json").content))
    assert read.to_json() == material.to_json()


def test_isotropy_is_what_turning_shows():
    assert is_isotropic(bc.material("lambert + ggx(a=0.01) + lafortune(cy=lafortune.cx)"))
    assert is_isotropic(bc.material("ward(ax=0.2, ay=0.2)"))
    assert not is_isotropic(bc.material("lambert + ward(ax=0.2, ay=0.21)"))
    assert not is_isotropic(bc.material("edwards(rx=0.3, ry=0.4)"))


ANY = bc.material("lambert")
REFUSED = [
    ("glsl", ANY, {}, UnknownNameError, r"Expected format to be a known name, got 'glsl'\. .*brdf_explorer"),
    ("json", ANY, {"orientation": (0.0, 1.0, 0.0)}, InvalidValueError, r"orientation to be left out for json"),
    *(
        ("radiance", ANY, {"orientation": axis}, InvalidValueError, r"orientation to be a direction of three numbers")
        for axis in ((0.0, 0.0, 0.0), (1.0, 2.0), (1e308, 1e308, 0.0), (math.nan, 0.0, 1.0), ("x", 0, 0), 5)
    ),
    ("json", "lambert", {}, InvalidValueError, "Expected material to be a Material, got str. Make one with bc.mater"),
    *(
        (name, bc.material("lambert(kd=[0.1, 0.2, 0.3, 0.4])"), {}, InvalidValueError, "one channel or three.* got 4")
        for name in bc.EXPORTS
        if name != "json"
    ),
    *(
        (name, bc.material("ggx(compensated)"), {}, InvalidValueError, "got compensated, which needs a table")
        for name in ("mitsuba", "brdf_explorer")
    ),
    ("merl", bc.material("ward(ax=0.1, ay=0.2)"), {}, InvalidValueError, "isotropic for a MERL table"),
    ("merl", bc.material("edwards"), {}, InvalidValueError, "reciprocal for a MERL table, got edwards"),
]


@pytest.mark.parametrize(("name", "material", "more", "kind", "message"), REFUSED)
def test_refusals(name, material, more, kind, message):
    with pytest.raises(kind, match=message):
        bc.export(material, name, **more)
