"""Every model on every device at hand: the same numbers as on the CPU, results where the directions are."""

import copy

import numpy as np
import pytest
import torch
from model_cases import CHOICE_IDS, DTYPES, EPS, EVERY_CHOICE, draw_values, lobe_pairs, material_of

import brdfcore as bc

needs_cuda = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA device; none is available")
DEVICES = ["cpu", pytest.param("cuda", marks=needs_cuda)]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("choice", EVERY_CHOICE, ids=CHOICE_IDS)
def test_results_follow_the_device_of_the_directions(choice, device):
    for dtype in (torch.float64,) if device == "cpu" else DTYPES:
        check_device(choice, dtype, device)


def check_device(choice: bc.Model, dtype: torch.dtype, device: str) -> None:
    rng = np.random.default_rng(71)
    material = material_of(choice, draw_values(choice, rng, where="mild", channels=3))
    moved = copy.deepcopy(material).to(device)
    wi, wo = lobe_pairs(material, rng, 50, dtype)
    u = torch.tensor(rng.uniform(0, 1, (len(wi), 3)), dtype=dtype)
    there_i, there_o, there_u = (x.to(device) for x in (wi, wo, u))
    tolerance = 200 * EPS[dtype]
    for one in (material, moved):  # values kept on the CPU follow the directions; so do those moved with .to()
        for got, expected in (
            (one.f(there_i, there_o), material.f(wi, wo)),
            (one.pdf(there_i, there_o), material.pdf(wi, wo)),
            (one.weight(there_i, there_o), material.weight(wi, wo)),
            (one.sample(there_o, there_u), material.sample(wo, u)),
        ):
            assert got.device.type == device
            assert got.dtype == dtype
            assert torch.allclose(got.detach().cpu(), expected.detach(), rtol=tolerance, atol=16 * EPS[dtype])
    moved.f(there_i, there_o).sum().backward()
    assert all(p.grad.isfinite().all() and p.grad.device.type == device for p in moved.parameters())


@pytest.mark.parametrize("device", DEVICES)
def test_sums_and_ties_on_a_device(device):
    text = "coupled_lambert(kd=[0.1, 0.2, 0.3], f0=kurt.f0) + kurt + lambert(kd=[0.6, 0.7, 0.8] - kurt.ks)"
    material, moved = bc.material(text), bc.material(text).to(device)
    w = torch.tensor([[0.0, 0.6, 0.8], [0.6, 0.0, 0.8]], dtype=torch.float64)
    got = moved.f(w.to(device), w.flip(0).to(device))
    assert got.device.type == device
    assert torch.allclose(got.cpu(), material.f(w, w.flip(0)), rtol=1e-13)
    assert str(moved.project_()) == str(material)
    assert moved.to_json() == material.to_json()
