"""The energy that microfacet lobes lose: its generator and its table against the albedo, and the verdict on both."""

import pytest
import torch

import brdfcore as bc
from brdfcore.energy import lost_energy
from brdfcore.energy.closed_forms import LOST_ERROR
from brdfcore.models.form import Form, Term

EVERY = [(name, word) for name in ("ggx", "beckmann") for word in lost_energy.MASKINGS]


def single_albedos(name: str, word: str, a: torch.Tensor, mu: torch.Tensor, tolerance: float) -> torch.Tensor:
    """The albedos of single scattering for widths (A,) and cosines (M,), (A, M)."""
    form = Form((Term(name, bc.MODELS[name](("isotropic", word, "constant", "single"))),))
    values = {f"{name}.ks": torch.ones(1).double(), f"{name}.a": a[:, None, None].expand(-1, len(mu), 1)}
    found = bc.energy.of_form(form, values, mu, torch.zeros(()).double(), tolerance)
    assert found.met
    return found.values[..., 0]


@pytest.mark.parametrize(("name", "word"), EVERY)
def test_the_generator_is_the_albedo(name, word):
    """Two quadratures, one in Cartesian slopes by panels, to 1e-6."""
    a, mu = torch.tensor([2e-4, 0.03, 0.4, 6.0]).double(), torch.tensor([1e-3, 0.05, 0.7]).double()
    albedo = single_albedos(name, word, a, mu, 1e-9)
    for i, width in enumerate(a.tolist()):
        for j, cosine in enumerate(mu.tolist()):
            lost = lost_energy.lost(name, width, cosine, 14, 2.5)[lost_energy.MASKINGS.index(word)]
            assert lost == pytest.approx(1 - float(albedo[i, j]), abs=1e-6), (width, cosine)


@pytest.mark.parametrize("count", [8, pytest.param(61, marks=pytest.mark.full)])
@pytest.mark.parametrize(("name", "word"), EVERY)
def test_the_table_is_as_exact_as_it_says(name, word, count):
    model = bc.MODELS[name](("isotropic", word, "constant", "compensated"))
    a = torch.logspace(-4, 1, count).double().clamp(1e-4, 10)
    mu = torch.cat([torch.logspace(-6, -1, count), torch.linspace(0.15, 1, count)]).double()
    lost = model.lost(mu, a[:, None])
    assert float((lost - (1 - single_albedos(name, word, a, mu, 1e-7))).abs().max()) <= LOST_ERROR


@pytest.mark.parametrize(
    "text", ["beckmann(constant, correlated, compensated, ks=1, a={})", "ggx(compensated, ks=1, f0=1, a={})"]
)
@pytest.mark.parametrize("a", [0.015, 0.3, 8.4])
def test_a_compensated_mirror_conserves_energy_to_what_its_table_is_exact_to(text, a):
    found = bc.certify(bc.material(text.format(a)))
    assert found.max_albedo == pytest.approx(1, abs=LOST_ERROR)
    assert found.allowed == LOST_ERROR
    assert found.energy_conserving
    assert found.exceeds is None
    assert found.verdict.startswith("Conserves energy: the largest albedo is 1,")


def test_no_more_is_allowed():
    """0.3 of a compensated mirror, and a Lambertian that makes the sum 1 + 1e-4."""
    found = bc.certify(bc.material("lambert(kd=0.7001) + ggx(compensated, ks=0.3, f0=1, a=0.3)"))
    assert found.allowed == pytest.approx(0.3 * LOST_ERROR)
    assert not found.energy_conserving
    assert found.exceeds is not None
    assert bc.certify(bc.material("lambert(kd=0.5)")).allowed == 0
