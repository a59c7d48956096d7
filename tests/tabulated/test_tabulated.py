"""Measured grids as materials: values, densities, samples, albedos and figures."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from rgl_file import rgl_bytes

import brdfcore as bc
import brdfcore.plots
from brdfcore.errors import BrdfError, FormatError, InvalidValueError
from brdfcore.formats import merl
from brdfcore.tabulated import GRIDDED
from brdfcore.tabulated import merl as merl_grid

TEXT = "lambert(kd=[0.3, 0.2, 0.1]) + kurt(ks=0.4, m=0.3)"
SHAPE = (45, 30, 60)


@pytest.fixture
def small_merl(monkeypatch, tmp_path) -> bc.Tabulated:
    """A material written as a small table and read back."""
    monkeypatch.setattr(merl, "SHAPE", SHAPE)
    bc.export(bc.material(TEXT), "merl", tmp_path / "small.binary")
    return bc.Tabulated.read(tmp_path / "small.binary")


@pytest.fixture
def small_rgl(tmp_path) -> bc.Tabulated:
    path = tmp_path / "small.bsdf"
    path.write_bytes(rgl_bytes())
    return bc.Tabulated.read(path)


@pytest.fixture(params=GRIDDED)
def table(request) -> bc.Tabulated:
    """One of each format."""
    return request.getfixturevalue(f"small_{request.param}")


def hemisphere(count: int, seed: int = 1) -> torch.Tensor:
    u = torch.tensor(np.random.default_rng(seed).uniform(0, 1, (count, 2)))
    radius, phi = torch.sqrt(1 - u[:, 0] ** 2), 2 * math.pi * u[:, 1]
    return torch.stack([radius * phi.cos(), radius * phi.sin(), u[:, 0]], -1)


def test_every_grid_file_is_in_the_registry() -> None:
    folder = Path(merl_grid.__file__).parent
    assert {path.stem for path in folder.glob("[!_]*.py")} | {"rgl"} == set(GRIDDED) | {
        "lawrence"
    }  # lawrence makes a grid of another
    assert set(GRIDDED) <= set(bc.FORMATS)


def test_f_is_the_table_at_its_centres(small_merl) -> None:
    wi, wo, _ = merl.grid()
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    wi, wo = torch.tensor(wi[above]), torch.tensor(wo[above])
    torch.testing.assert_close(small_merl.f(wi, wo), bc.material(TEXT).f(wi, wo).detach(), rtol=1e-9, atol=0)


def test_f_is_near_the_material_between_them(small_merl) -> None:
    """Interpolation is of second order: far better than the nearest bin."""
    wi, wo = hemisphere(3000), hemisphere(3000, 2)
    inner = (wi[:, 2] > 0.1) & (wo[:, 2] > 0.1)
    expected = bc.material(TEXT).f(wi, wo).detach()[inner]
    error = ((small_merl.f(wi, wo)[inner] - expected).abs() / expected).max(-1).values
    assert error.quantile(0.95) < 5e-3
    assert error.max() < 0.1


def test_f_is_what_read_yields(small_rgl, tmp_path) -> None:
    samples = bc.read(tmp_path / "small.bsdf")
    found = small_rgl.f(samples.wi, samples.wo)
    # at the grid's edge one direction has several nodes (tests/formats/test_rgl.py)
    assert torch.isclose(found, samples.values, rtol=1e-6).all(-1).double().mean() > 0.6


def test_nothing_below_the_horizon_and_types_are_kept(table) -> None:
    wi, wo = hemisphere(50).float(), hemisphere(50, 2).float()
    below = wi * torch.tensor([1.0, 1.0, -1.0])
    for f, columns in ((table.f, 3), (table.weight, 3)):
        assert f(wi, wo).dtype == torch.float32
        assert f(wi[:, None], wo).shape == (50, 50, columns)
        assert not f(below, wo).any()
        assert not f(wi, wo * torch.tensor([1.0, 1.0, -1.0])).any()
    assert table.pdf(wi, wo).shape == (50,)
    assert not table.pdf(below, wo).any()
    u = torch.rand(20, 50, 3, generator=torch.Generator().manual_seed(1))
    assert table.sample(wo, u).shape == (20, 50, 3)
    assert table.sample(wo, u).dtype == torch.float32
    assert table.f(wi[:0], wo[:0]).shape == (0, 3)
    assert table.sample(wo[:0], u[0, :0]).shape == (0, 3)
    assert not table.f(torch.tensor([[0.0, 0.0, 1.0]]), torch.tensor([[0.0, 0.0, 1.0]])).isnan().any()


@pytest.mark.parametrize("degrees", [0, 40, 75])
def test_samples_follow_the_density(table, degrees) -> None:
    """Means of three functions over samples against integrals of the density, at four standard errors."""
    wo = torch.tensor([math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))], dtype=torch.float64)
    u = torch.quasirandom.SobolEngine(3, scramble=True, seed=3).draw(2**14, dtype=torch.float64)
    wi = table.sample(wo, u)
    anywhere = hemisphere(2**16, 5)
    density = table.pdf(anywhere, wo.expand_as(anywhere)) * 2 * math.pi
    for g in (lambda w: w[:, 2], lambda w: w[:, 2] * (w[:, 0] < -0.3), lambda w: torch.exp(-8 * (w[:, 1] ** 2))):
        found = torch.where(wi[:, 2] > 0, g(wi), 0.0)
        expected = g(anywhere) * density
        error = math.sqrt(found.var() / len(found) + expected.var() / len(expected))
        assert abs(found.mean() - expected.mean()) < 4 * error + 1e-4


def test_the_albedo_is_the_materials(small_merl) -> None:
    theta = torch.tensor([0.0, 0.5, 1.0], dtype=torch.float64)
    found = bc.albedo(small_merl, theta, tolerance=2e-3)
    expected = bc.albedo(bc.material(TEXT), theta).values.detach()
    assert found.met
    assert found.method == "sobol"
    assert bool((found.error <= 2e-3).all())
    # the claimed error, and 1e-3 that a coarse table's interpolation makes
    assert bool(((found.values - expected).abs() <= found.error + 1e-3).all())


def test_the_albedo_is_that_of_any_sampling(small_rgl) -> None:
    """Against directions that are uniform over the hemisphere."""
    wo = torch.tensor([0.6, 0.0, 0.8], dtype=torch.float64)
    wi = hemisphere(2**16, 9)
    values = small_rgl.f(wi, wo.expand_as(wi)) * wi[:, 2:] * 2 * math.pi
    found = bc.albedo(small_rgl, math.acos(0.8), tolerance=1e-4)
    assert not found.met
    assert found.evaluations == 2**15
    slack = 4 * values.std(0) / 256 + found.error
    assert bool(((values.mean(0) - found.values).abs() < slack).all())


def test_figures_stand_beside_fitted_ones(table, monkeypatch) -> None:
    monkeypatch.setattr(sys.modules["brdfcore.plots.albedo"], "POINTS", 7)
    figure = bc.plots.albedo({"measured": table, "model": bc.material("lambert + ggx")}, tolerance=0.1)
    assert figure.legends[0].legend_handles[0].get_label().startswith("measured")
    figure = bc.plots.lobes(table, theta_i_deg=[20, 60])
    title, caption = (text.get_text() for text in figure.texts)
    assert "small." in title
    assert "channel r," in caption
    assert str(table).startswith("small.")
    assert table.channels == 3
    assert table.channel_names == ("r", "g", "b")


def test_refusals(tmp_path, small_merl) -> None:
    table = tmp_path / "table.csv"
    table.write_text("theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n1,2,3,4,5\n")
    with pytest.raises(FormatError, match=r"Expected a file that is a grid \(merl or rgl\), got csv"):
        bc.Tabulated.read(table)
    with pytest.raises(FormatError, match=r"Expected path to be a readable file, got 'none\.binary'"):
        bc.Tabulated.read(tmp_path / "none.binary")
    with pytest.raises(InvalidValueError, match="method to be auto or sobol for a measured grid, got 'closed_form'"):
        bc.albedo(small_merl, 0.3, method="closed_form")
    with pytest.raises(BrdfError, match="Expected wi to be"):
        small_merl.f(torch.zeros(3, dtype=torch.int64), torch.zeros(3))


def test_a_real_files_albedo_is_plausible(measured) -> None:
    """Below 1 at every angle; white vinyl is brighter than black-green paint."""
    theta = torch.tensor([0.1, 0.7, 1.2], dtype=torch.float64)
    white, green = (
        bc.albedo(bc.Tabulated.read(measured / "rgl" / f"{name}_rgb.bsdf"), theta, tolerance=1e-2).values
        for name in ("aurora_white", "cm_military_green")
    )
    assert bool((white > green).all())
    assert white.min() > 0.3
    assert white.max() < 1
    assert green.min() > 0.01
