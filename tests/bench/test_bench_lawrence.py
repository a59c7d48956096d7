"""Kurt et al. 2010, section 5.2: size and error of the factored form beside fits of one, two and three lobes.

The tables are reconstructions of MERL materials by the networks of Sztrajman et al. 2021, not measurements; the paper's
factored forms took 176, 120 and 384 KB of them.
"""

import pytest
import torch
from reconstruction import merl_reconstruction

import brdfcore as bc
from brdfcore.fitting import errors

pytestmark = pytest.mark.bench
MATERIALS = {"blue-metallic-paint": 176, "nickel": 120, "yellow-matte-plastic": 384}
EVERY = 101  # bins of which one is fitted to, and of which another one is compared
STEEPEST = 80.0  # degrees; steeper bins are noise in MERL's tables, and the paper leaves them out
TERMS = ((4, 1), (4, 2), (8, 2))
BYTES = 4  # a number of single precision


@pytest.mark.parametrize("name", MATERIALS)
def test_factored_forms_and_lobes(name, measured, tmp_path, show) -> None:
    path = tmp_path / f"{name}.binary"
    path.write_bytes(merl_reconstruction(measured, name))
    table, every = bc.Tabulated.read(path), bc.read(path)
    least = torch.cos(torch.deg2rad(torch.tensor(STEEPEST)))
    inner = ((every.wi[:, 2] > least) & (every.wo[:, 2] > least)).nonzero()[:, 0]
    fitted, compared = every.subset(inner[::EVERY]), every.subset(inner[EVERY // 2 :: EVERY])
    show(f"{name} (reconstruction)      kB     l2 error")
    found = {}
    for outer, inner_terms in TERMS:
        made = bc.lawrence(table, outer, inner_terms)
        found["factored"] = errors(made, compared)["l2"]
        show(f"  factored, J={outer} K={inner_terms}    {made.grid.kilobytes:8.2f}   {found['factored']:.5f}")
    for lobes in (1, 2, 3):
        fit = bc.fit(fitted, "lambert" + " + kurt" * lobes, loss="l2")
        size = BYTES * sum(value.numel() for value in fit.material.values().values()) / 1000
        found["lobes"] = errors(fit.material, compared)["l2"]
        show(f"  lambert + {lobes} x kurt    {size:8.3f}   {found['lobes']:.5f}   {fit.cost.seconds:.1f} s")
    show(f"  (the paper's factored form: {MATERIALS[name]} kB)")
    assert found["factored"] < found["lobes"]
