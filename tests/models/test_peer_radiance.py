"""Values against Radiance: WGMDfunc is `lambert + ward_bounded`; ashik2 is documented, not the textbook's."""

import numpy as np
import pytest
import torch
from model_cases import hemisphere
from rtrace import Array, frames, rendered

import brdfcore as bc

PAIRS = 300
PRECISION = 1e-6


def pairs(rng: np.random.Generator, lobe: bc.Material) -> tuple[torch.Tensor, torch.Tensor]:
    """Directions (wi, wo), half of them where the lobe reflects and half anywhere, none within 3 degrees of grazing."""
    wo = hemisphere(rng, 8 * PAIRS)
    drawn = lobe.sample(wo, torch.tensor(rng.uniform(0, 1, (8 * PAIRS, 3)))).detach()
    wi = torch.where(torch.tensor(rng.uniform(0, 1, (8 * PAIRS, 1)) < 0.5), drawn, hemisphere(rng, 8 * PAIRS))
    keep = (wi[:, 2] > 0.05) & (wo[:, 2] > 0.05)
    return wi[keep][:PAIRS], wo[keep][:PAIRS]


WARD = [
    ([0.1, 0.1, 0.1], [0.3, 0.3, 0.3], "a=0.2"),
    ([0.3, 0.2, 0.1], [0.05, 0.1, 0.2], "a=0.05"),
    ([0.0, 0.0, 0.0], [0.9, 0.5, 0.1], "ax=0.1, ay=0.3"),
    ([0.5, 0.1, 0.02], [0.2, 0.3, 0.4], "ax=0.6, ay=0.08"),
]


@pytest.mark.parametrize(("kd", "rs", "width"), WARD)
def test_ward_bounded_is_radiances_wgmdfunc(tmp_path, kd, rs, width):
    """kd/pi + rs |H|^2 E / (pi ax ay Hz^4): the colour of the lobe is its modifier's."""
    widths = [word.split("=")[1] for word in width.split(", ")]
    ours = bc.material(f"lambert(kd={kd}) + ward_bounded(rs={rs}, {width})")
    rng = np.random.default_rng(91)
    wi, wo = pairs(rng, bc.material(f"ward_bounded({width})"))

    def material(number: int, x: Array) -> str:
        red, green, blue = rs
        front = " ".join(map(str, kd))
        axis = " ".join(f"{c:.17f}" for c in x)
        return (
            f"void colorfunc c{number} 4 {red} {green} {blue} . 0 0\n"
            f"void WGMDfunc m{number} 13 c{number} 1 {widths[0]} {widths[-1]} void 0 0 0 void {axis} . "
            f"0 9 {front} 0 0 0 0 0 0"
        )

    theirs = rendered(tmp_path, wi.numpy(), wo.numpy(), frames(rng, wi.numpy()), material)
    f = ours.f(wi, wo).detach().numpy()
    assert len(f) == PAIRS
    assert f[:, 0].max() > 3 * np.median(f[:, 0])  # the lobe is in it
    np.testing.assert_allclose(theirs, f, rtol=PRECISION, atol=1e-6)


@pytest.mark.parametrize(("nu", "nv"), [(10, 10), (100, 100), (400, 20), (5, 2000)])
def test_ashikhmin_and_shirleys_lobe_is_that_of_radiances_ashik2(tmp_path, nu, nv):
    """Its Schlick factor is of n.v and its diffuse term is d/pi (1 - (1 - n.l)^5); the lobe between them is ours."""
    diffuse, specular = np.array([0.3, 0.2, 0.1]), np.array([0.05, 0.3, 0.8])
    lobe = bc.material(f"ashikhmin_shirley(constant, ks=1, nu={nu}, nv={nv})")
    rng = np.random.default_rng(92)
    wi, wo = pairs(rng, lobe)

    def material(number: int, x: Array) -> str:
        axis = " ".join(f"{c:.17f}" for c in x)
        colours = " ".join(f"{c}" for c in (*diffuse, *specular))
        return f"void ashik2 m{number} 4 {axis} . 0 8 {colours} {nu} {nv}"

    theirs = rendered(tmp_path, wi.numpy(), wo.numpy(), frames(rng, wi.numpy()), material)
    ci, co = wi.numpy()[:, 2:], wo.numpy()[:, 2:]
    fresnel = specular + (1 - specular) * (1 - co) ** 5
    f = diffuse / np.pi * (1 - (1 - ci) ** 5) + fresnel * lobe.f(wi, wo).detach().numpy()
    np.testing.assert_allclose(theirs, f, rtol=PRECISION, atol=1e-6)
