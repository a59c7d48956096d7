"""MERL tables: what is written reads back, bin by bin, and the stated difference is that of a nearest-bin lookup."""

import numpy as np
import pytest
import torch
from export_cases import directions

import brdfcore as bc
from brdfcore.formats import merl

TEXT = "lambert(kd=[0.3, 0.2, 0.1]) + kurt(ks=0.4, m=0.3)"


@pytest.mark.parametrize("shape", [(45, 30, 60), pytest.param(merl.SHAPE, marks=pytest.mark.full)])
def test_reads_back_to_rounding(shape, tmp_path, monkeypatch):
    """Every bin above the horizon, in the library's own reader."""
    monkeypatch.setattr(merl, "SHAPE", shape)
    material = bc.material(TEXT)
    made = bc.export(material, "merl", tmp_path / "out.binary")
    samples = bc.read(tmp_path / "out.binary")
    assert samples.format == "merl"
    with torch.no_grad():
        expected = material.f(samples.wi, samples.wo)
    torch.testing.assert_close(samples.values, expected, rtol=5e-16, atol=0)
    wi, wo, _ = merl.grid()
    assert len(samples) == int(((wi[:, 2] > 1e-9) & (wo[:, 2] > 1e-9)).sum())
    assert 0 < made.difference < 0.2
    rng = np.random.default_rng(3)
    wi, wo = directions(rng, 1000).numpy(), directions(rng, 1000).numpy()
    assert (merl.bins(wi, wo) == merl.bins(wo, wi)).mean() > 0.99  # the table is reciprocal, but for bins' edges


def test_a_gray_material_fills_three_planes(tmp_path, monkeypatch):
    monkeypatch.setattr(merl, "SHAPE", (9, 6, 12))
    bc.export(bc.material("lambert(kd=0.3)"), "merl", tmp_path / "out.binary")
    values = bc.read(tmp_path / "out.binary").values
    torch.testing.assert_close(values, torch.full_like(values, 0.3 / np.pi), rtol=1e-15, atol=0)


def test_the_lookup_inverts_the_grid(monkeypatch):
    monkeypatch.setattr(merl, "SHAPE", (30, 18, 36))
    wi, wo, _ = merl.grid()
    above = np.flatnonzero((wi[:, 2] > 0) & (wo[:, 2] > 0))
    assert (merl.bins(wi[above], wo[above]) == above).all()


@pytest.mark.parametrize("scale", [0.5, 2])
def test_finer_tables_are_nearer(scale, monkeypatch):
    shape = tuple(int(n * scale) for n in (40, 30, 60))
    monkeypatch.setattr(merl, "SHAPE", (40, 30, 60))
    usual = bc.export(bc.material(TEXT), "merl").difference
    monkeypatch.setattr(merl, "SHAPE", shape)
    assert bc.export(bc.material(TEXT), "merl").difference / usual == pytest.approx(1 / scale, rel=0.35)
