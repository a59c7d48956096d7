"""The factored form of a table: nearer with more terms, small, and sampled by its own factors."""

import math

import numpy as np
import pytest
import torch
from rgl_file import rgl_arrays, tensor_file

import brdfcore as bc
from brdfcore.errors import InvalidValueError
from brdfcore.formats import merl
from brdfcore.tabulated.lawrence import AZIMUTHS, HEIGHTS, NODES, factorised, lawrence

TEXT = "lambert(kd=[0.06, 0.04, 0.02]) + kurt(ks=0.6, f0=0.5, m=0.2, alpha=0)"


@pytest.fixture(scope="module")
def table(tmp_path_factory) -> bc.Tabulated:
    """A smooth material as a small table."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(merl, "SHAPE", (45, 30, 60))
        path = tmp_path_factory.mktemp("lawrence") / "small.binary"
        bc.export(bc.material(TEXT), "merl", path)
        yield bc.Tabulated.read(path)


@pytest.fixture(scope="module")
def factored(table) -> bc.Tabulated:
    return lawrence(table, 4, 2)


def hemisphere(count: int, seed: int = 1) -> torch.Tensor:
    u = torch.tensor(np.random.default_rng(seed).uniform(0, 1, (count, 2)))
    radius, phi = torch.sqrt(1 - u[:, 0] ** 2), 2 * math.pi * u[:, 1]
    return torch.stack([radius * phi.cos(), radius * phi.sin(), u[:, 0]], -1)


def test_factors_of_a_product_are_found_again() -> None:
    rng = np.random.default_rng(1)
    matrix = rng.uniform(0, 1, (30, 3)) @ rng.uniform(0, 1, (3, 40))
    left, right = factorised(matrix, 3)
    assert min(left.min(), right.min()) >= 0
    assert np.linalg.norm(left @ right - matrix) < 2e-2 * np.linalg.norm(matrix)


def test_its_error_falls_with_its_terms_and_is_what_it_says(table, factored) -> None:
    few = lawrence(table, 1, 1)
    assert factored.grid.error < 0.12
    assert factored.grid.error < 0.3 * few.grid.error
    for made in (few, factored):
        wi, wo = hemisphere(20_000), hemisphere(20_000, 2)
        inner = wo[:, 2] > math.cos(math.radians(88))
        expected, found = (t.f(wi, wo)[inner] * wi[inner, 2:] for t in (table, made))
        difference = ((found - expected).square().sum() / expected.square().sum()).sqrt()
        # the matrix weighs by the half vector's solid angle and by cos theta_o, here wi's counts
        assert difference == pytest.approx(made.grid.error, rel=0.3)


def test_its_size_is_that_of_its_factors(factored) -> None:
    grid = factored.grid
    assert grid.kilobytes == 4 * 8 * (3 * NODES + HEIGHTS + AZIMUTHS) / 1000
    assert min(grid.outgoing.min(), grid.heights.min(), grid.azimuths.min()) >= 0
    assert str(factored) == "small.binary, factored"


@pytest.mark.parametrize("degrees", [0, 45, 80])
def test_its_samples_follow_its_density(factored, degrees) -> None:
    azimuth = 0.7
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    wo = torch.tensor([sine * math.cos(azimuth), sine * math.sin(azimuth), cosine], dtype=torch.float64)
    u = torch.quasirandom.SobolEngine(3, scramble=True, seed=3).draw(2**14, dtype=torch.float64)
    wi = factored.sample(wo, u)
    anywhere = hemisphere(2**16, 5)
    density = factored.pdf(anywhere, wo.expand_as(anywhere)) * 2 * math.pi
    for g in (lambda w: w[:, 2], lambda w: w[:, 2] * (w[:, 0] < -0.3), lambda w: torch.exp(-8 * (w[:, 1] ** 2))):
        found = torch.where(wi[:, 2] > 0, g(wi), 0.0)
        expected = g(anywhere) * density
        error = math.sqrt(found.var() / len(found) + expected.var() / len(expected))
        assert abs(found.mean() - expected.mean()) < 4 * error + 1e-4


def test_its_albedo_is_the_materials(factored) -> None:
    theta = torch.tensor([0.2, 1.0], dtype=torch.float64)
    found = bc.albedo(factored, theta, tolerance=3e-3)
    expected = bc.albedo(bc.material(TEXT), theta).values.detach()
    assert bool(((found.values - expected).abs() <= found.error + 0.05 * expected).all())


def test_its_samples_are_worth_more_than_the_cosines(factored) -> None:
    """The variance of its weights beside that of cosine-distributed directions."""
    wo = torch.tensor([0.6, 0.0, 0.8], dtype=torch.float64)
    u = torch.quasirandom.SobolEngine(3, scramble=True, seed=3).draw(2**13, dtype=torch.float64)
    wi = factored.sample(wo, u)
    own = factored.weight(wi, wo.expand_as(wi)).mean(-1)
    radius, phi = torch.sqrt(u[:, 1]), 2 * math.pi * u[:, 2]
    diffuse = torch.stack([radius * phi.cos(), radius * phi.sin(), torch.sqrt(1 - u[:, 1])], -1)
    plain = factored.f(diffuse, wo.expand_as(diffuse)).mean(-1) * math.pi
    assert own.mean() == pytest.approx(plain.mean().item(), rel=0.05)
    assert own.var() < 0.2 * plain.var()


def test_refusals(table, tmp_path) -> None:
    path = tmp_path / "turned.bsdf"
    path.write_bytes(tensor_file(rgl_arrays(azimuths=(-3.1, -2.0, 0.0))))
    with pytest.raises(InvalidValueError, match=r"the table to be isotropic, got turned\.bsdf, measured at several"):
        lawrence(bc.Tabulated.read(path))
    with pytest.raises(InvalidValueError, match="Expected inner to be at least 1, got 0"):
        lawrence(table, 2, 0)
