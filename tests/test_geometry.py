"""Half vectors, slopes and cosines: exact to the horizon, safe below it, computed on demand."""

import importlib.util
import math
import re
import sys

import jaxtyping
import mpmath
import numpy as np
import pytest
import torch

from brdfcore import geometry as module
from brdfcore.errors import InvalidValueError
from brdfcore.geometry import FLOOR, QUANTITIES, Geometry, from_angles, geometry, reflect

DTYPES = [torch.float32, torch.float64]
mp = mpmath.mp.clone()
mp.dps = 50


def unit(rng: np.random.Generator, count: int, lowest: float = 0.0) -> torch.Tensor:
    z, phi = rng.uniform(lowest, 1, count), rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(1 - z * z)
    return torch.tensor(np.stack([r * np.cos(phi), r * np.sin(phi), z], -1))


@pytest.mark.parametrize("dtype", DTYPES)
def test_quantities_against_exact_arithmetic(dtype):
    rng = np.random.default_rng(81)
    wi, wo = unit(rng, 60).to(dtype), unit(rng, 60).to(dtype)
    for height in (1e-12, 1e-8, 1e-4):  # grazing, near each other and opposite
        for turn in (0.0, 1e-6, 1.0, math.pi - 1e-6, math.pi):
            pair = [[1.0, 0.0, height], [math.cos(turn), math.sin(turn), height]]
            wi = torch.cat([wi, torch.tensor([pair[0]], dtype=torch.float64).to(dtype)])
            wo = torch.cat([wo, torch.tensor([pair[1]], dtype=torch.float64).to(dtype)])
    g = geometry(wi, wo, QUANTITIES)
    eps = torch.finfo(dtype).eps
    for k in range(len(wi)):
        i, o = ([mp.mpf(x) for x in w[k].tolist()] for w in (wi, wo))
        h = [a + b for a, b in zip(i, o, strict=True)]
        norm = mp.sqrt(sum(c * c for c in h))
        exact = {
            "xi": i[0],
            "yi": i[1],
            "xo": o[0],
            "yo": o[1],
            "ci": i[2],
            "co": o[2],
            "hz": h[2],
            "p": h[0] / h[2],
            "q": h[1] / h[2],
            "e2": (h[0] / h[2]) ** 2 + (h[1] / h[2]) ** 2,
            "ux": h[0] / norm,
            "uy": h[1] / norm,
            "uz": h[2] / norm,
            "h_dot_wo": norm / 2,
        }
        exact |= {f"over_{name}": 1 / value for name, value in exact.items() if name in ("ci", "co", "hz", "h_dot_wo")}
        for name in QUANTITIES:
            assert abs(float(getattr(g, name)[k, 0]) - exact[name]) <= 4 * eps * abs(exact[name]), (name, k)
    assert g.above.all()


@pytest.mark.parametrize("dtype", DTYPES)
def test_the_half_vector_is_the_textbooks(dtype):
    """tan^2 theta_h = e2 and h.wo = h.wi, from a normalised half vector; where that is well conditioned."""
    rng = np.random.default_rng(82)
    wi, wo = unit(rng, 200, 0.1).to(dtype), unit(rng, 200, 0.1).to(dtype)
    g = geometry(wi, wo, QUANTITIES)
    h = torch.nn.functional.normalize((wi + wo).double(), dim=-1)
    tolerance = 50 * torch.finfo(dtype).eps
    assert torch.allclose(g.e2[:, 0].double(), h[:, 2] ** -2 - 1, rtol=tolerance, atol=tolerance)
    for w in (wi, wo):
        assert torch.allclose(g.h_dot_wo[:, 0].double(), (h * w).sum(-1), rtol=tolerance)


@pytest.mark.parametrize("dtype", DTYPES)
def test_pairs_at_or_below_the_horizon_are_evaluated_at_the_normal(dtype):
    bad = torch.tensor([[1.0, 0.0, 0.0], [1.0, 0.0, -0.0], [0.6, 0.0, -0.8], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
    bad = bad.to(dtype)
    good = torch.tensor([0.6, 0.0, 0.8], dtype=dtype)
    for wi, wo in ((bad, good), (good, bad), (bad, bad)):
        g = geometry(wi, wo, QUANTITIES)
        assert not g.above.any()
        for name in QUANTITIES:
            expected = {"over_hz": 0.5, **dict.fromkeys(("xi", "yi", "xo", "yo", "p", "q", "e2", "ux", "uy"), 0)}.get(
                name, 1
            )
            assert bool((getattr(g, name) == expected).all()), name


@pytest.mark.parametrize("dtype", DTYPES)
def test_masked_pairs_have_zero_gradients(dtype):
    wi = torch.tensor([[1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [-1.0, 0.0, 0.0]], dtype=dtype, requires_grad=True)
    wo = torch.tensor([[-1.0, 0.0, 0.0], [0.6, 0.0, 0.8], [1.0, 0.0, 1e-12]], dtype=dtype, requires_grad=True)
    g = geometry(wi, wo, QUANTITIES)
    total = sum(getattr(g, name).sum() for name in QUANTITIES)
    for gradient in torch.autograd.grad(total, [wi, wo]):
        assert bool((gradient == 0).all())


@pytest.mark.parametrize("dtype", DTYPES)
def test_gradients_are_exact_at_the_normal(dtype):
    """h = n exactly: e2 and its gradient are 0, p and q move with the directions."""
    w = torch.tensor([0.6, 0.0, 0.8], dtype=dtype, requires_grad=True)
    v = torch.tensor([-0.6, 0.0, 0.8], dtype=dtype)
    g = geometry(w, v, QUANTITIES)
    assert g.e2.item() == 0
    (by_e2,) = torch.autograd.grad(g.e2.sum(), w, retain_graph=True)
    assert by_e2.tolist() == [0, 0, 0]
    (by_p,) = torch.autograd.grad(g.p.sum(), w)
    assert by_p.tolist() == pytest.approx([1 / 1.6, 0, 0], rel=1e-6)


@pytest.mark.parametrize("dtype", DTYPES)
def test_cosines_have_a_floor(dtype):
    smallest = torch.nextafter(torch.zeros((), dtype=dtype), torch.ones((), dtype=dtype)).item()
    w = torch.tensor([1.0, 0.0, smallest], dtype=dtype)
    g = geometry(w, w, QUANTITIES)
    assert g.above.all()
    assert g.ci.item() == FLOOR[dtype]
    assert all(getattr(g, name).isfinite().all() for name in QUANTITIES)
    assert 0 < FLOOR[dtype] < 1e-12


def test_gradcheck_of_every_quantity():
    rng = np.random.default_rng(83)
    wi, wo = unit(rng, 4, 0.1).requires_grad_(), unit(rng, 4, 0.1).requires_grad_()
    for name in sorted(QUANTITIES):
        assert torch.autograd.gradcheck(lambda a, b, name=name: getattr(geometry(a, b, {name}), name), (wi, wo))


@pytest.mark.filterwarnings("ignore:.*should not be instantiated:DeprecationWarning")  # dynamo's own doing
@pytest.mark.parametrize("dtype", DTYPES)
def test_to_a_compiler_it_is_one_graph(dtype, monkeypatch):
    """Pieces that are evaluated apart would cost the compiled forms most of their speed.

    As it is shipped: the tests' type checks are no code to compile.
    """
    spec = importlib.util.spec_from_file_location("brdfcore.geometry_as_shipped", module.__file__)
    shipped = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, shipped)
    spec.loader.exec_module(shipped)
    rng = np.random.default_rng(85)
    wi, wo = unit(rng, 5).to(dtype), unit(rng, 3).to(dtype)[:, None]
    compiled = torch.compile(lambda wi, wo: shipped.geometry(wi, wo, QUANTITIES), fullgraph=True, backend="eager")
    for got, expected in zip(compiled(wi, wo), geometry(wi, wo, QUANTITIES), strict=True):
        assert torch.equal(got, expected)


def test_only_what_is_asked_for_is_computed():
    w = torch.tensor([0.6, 0.0, 0.8])
    for name in QUANTITIES:
        g = geometry(w, w, {name})
        assert [field for field in Geometry._fields if getattr(g, field) is not None] == ["above", name]
    assert geometry(w, w, ()).above.all()
    with pytest.raises(AttributeError):
        geometry(w, w, {"no such quantity"})


def test_quantities_are_the_geometrys_fields():
    assert set(Geometry._fields) == QUANTITIES | {"above"}


def test_shapes_broadcast():
    rng = np.random.default_rng(84)
    wi, wo = unit(rng, 5), unit(rng, 3)
    g = geometry(wi[:, None], wo, QUANTITIES)
    assert g.above.shape == g.e2.shape == g.h_dot_wo.shape == (5, 3, 1)
    assert geometry(wi[0], wo[0], {"e2"}).e2.shape == (1,)
    assert geometry(wi[:0], wo[0], {"e2"}).e2.shape == (0, 1)


def test_precisions_are_promoted():
    rng = np.random.default_rng(85)
    wi, wo = unit(rng, 5), unit(rng, 5).float()
    mixed, double = geometry(wi, wo, {"e2"}), geometry(wi, wo.double(), {"e2"})
    assert mixed.e2.dtype == torch.float64
    assert torch.equal(mixed.e2, double.e2)


@pytest.fixture
def as_shipped():
    """Without the tests' type checks, which would refuse bad input before the package's own sentences do."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("which", ["wi", "wo"])
@pytest.mark.parametrize("shape", [(), (2,), (3, 1), (3, 4)], ids=str)
def test_other_shapes_are_refused(which, shape):
    pair = {"wi": torch.ones(3), "wo": torch.ones(3)} | {which: torch.ones(shape)}
    rule = "unit vectors on a last axis of length 3"
    sentence = f"Expected {which} to be {rule}, got shape {shape}. Pass directions as (..., 3)."
    with pytest.raises(InvalidValueError, match=f"^{re.escape(sentence)}$") as caught:
        geometry(**pair, needs=())
    assert caught.value.field == which


@pytest.mark.usefixtures("as_shipped")
@pytest.mark.parametrize("which", ["wi", "wo"])
@pytest.mark.parametrize("dtype", [torch.float16, torch.bfloat16, torch.int32, torch.complex128], ids=str)
def test_other_dtypes_are_refused(which, dtype):
    pair = {"wi": torch.ones(3), "wo": torch.ones(3)} | {which: torch.ones(3).to(dtype)}
    sentence = f"Expected {which} to be float32 or float64, got {dtype}. Convert it with {which}.float()."
    with pytest.raises(InvalidValueError, match=f"^{re.escape(sentence)}$") as caught:
        geometry(**pair, needs=())
    assert caught.value.field == which


def test_from_angles():
    theta, phi = torch.tensor([0.0, 0.5, math.pi / 2], dtype=torch.float64), torch.tensor(0.7, dtype=torch.float64)
    w = from_angles(theta, phi)
    expected = [[math.sin(t) * math.cos(0.7), math.sin(t) * math.sin(0.7), math.cos(t)] for t in theta.tolist()]
    assert w.shape == (3, 3)
    assert torch.allclose(w, torch.tensor(expected, dtype=torch.float64), rtol=1e-15, atol=1e-16)
    assert from_angles(theta[:, None], torch.zeros(4, dtype=torch.float64)).shape == (3, 4, 3)
    assert from_angles(theta.float(), phi.float()).dtype == torch.float32
    assert from_angles(-theta, phi)[1].tolist() == pytest.approx(
        from_angles(theta, phi + math.pi)[1].tolist(), abs=1e-15
    )


@pytest.mark.parametrize("dtype", DTYPES)
def test_reflect_is_the_mirror_of_the_half_vector(dtype):
    rng = np.random.default_rng(86)
    wi, wo = unit(rng, 100, 0.05).to(dtype), unit(rng, 100, 0.05).to(dtype)
    g = geometry(wi, wo, {"p", "q"})
    mirrored = reflect(wo, g.p, g.q)
    tolerance = 200 * torch.finfo(dtype).eps
    assert torch.allclose(mirrored, wi, rtol=0, atol=tolerance)
    assert torch.allclose(reflect(mirrored, g.p, g.q), wo, rtol=0, atol=tolerance)
    steep = torch.full((100, 1), 1e3, dtype=dtype)
    assert torch.allclose(reflect(wo, steep, -steep).norm(dim=-1), torch.ones(100, dtype=dtype), rtol=0, atol=tolerance)
    zero = torch.zeros(100, 1, dtype=dtype)
    assert torch.equal(reflect(wo, zero, zero), wo * torch.tensor([-1, -1, 1], dtype=dtype))
