"""What a table of albedos costs beside Sobol points at equal accuracy: 90 polar angles times 32 widths.

The peer is the mean weight of the lobe's own samples at scrambled Sobol points, batched. It runs for a part of the
table at two numbers of points; its errors there, against our reference, tell a power of that number. Its time is
extrapolated by that power: each entry gets the number of points that brings 3.29 standard errors, as much as one result
in 1,000 exceeds, to the tolerance, which ours claims as surely. So the peer knows its errors beforehand, and wastes
nothing. From the part to the whole table time is in proportion. Ours is timed whole, as it is called.
"""

import math
import time
from typing import NamedTuple

import pytest
import torch
from timing import ratio

import brdfcore as bc
from brdfcore.geometry import from_angles

pytestmark = pytest.mark.bench

ANGLES, WIDTHS = 90, 32
WIDTH = torch.logspace(-2, 0, WIDTHS, dtype=torch.float64)
THETA = torch.arange(ANGLES, dtype=torch.float64).deg2rad()
PART = (slice(4, None, 17), slice(3, None, 8))  # of both axes, for the peer
POINTS = (2**11, 2**14)
SCRAMBLES = 4
SURE = 3.29  # standard errors
LEAST = 16  # points of an entry
SLOWEST, FASTEST = 0.5, 1.5  # powers of the number of points by which an error can fall

EXPONENT = 2 / WIDTH.square()
CASES = {
    "ward(rs=1)": {"a": WIDTH},
    "ward_duer(rs=1)": {"a": WIDTH},
    "ward_neumann(rs=1)": {"a": WIDTH},
    "ashikhmin_shirley(f0=0.5)": {"n": EXPONENT},
    "kurt(f0=0.5, ks=1, alpha=0.2)": {"m": WIDTH},
    "kurt_plausible(f0=0.5, ks=1)": {"m": WIDTH},
    "blinn_phong(ks=1)": {"n": EXPONENT},
    "cook_torrance(f0=0.5, ks=1)": {"a": WIDTH},
    "ashikhmin_premoze(f0=0.5, ks=1)": {"a": WIDTH},
    "ggx(f0=0.5, ks=1)": {"a": WIDTH},
    "beckmann(f0=0.5, ks=1)": {"a": WIDTH},
    "ward_duer(rs=1, ay=0.3)": {"ax": WIDTH},
    "ward_neumann(rs=1, ay=0.3)": {"ax": WIDTH},
    "ggx(f0=0.5, ks=1, ay=0.3)": {"ax": WIDTH},
}


class Table(NamedTuple):
    """A lobe whose widths are an axis."""

    material: bc.Material
    values: dict[str, torch.Tensor]

    def albedos(self, tolerance: float) -> bc.Albedo:
        """The whole table, (ANGLES, WIDTHS, 1)."""
        phi = torch.tensor(0.5, dtype=torch.float64)
        return bc.energy.of_form(self.material.form, self.values, torch.cos(THETA)[:, None], phi, tolerance)

    def drawn(self, points: torch.Tensor) -> torch.Tensor:
        """The mean weights of the peer's part of the table over points (N, 3), (angles, widths)."""
        form = self.material.form
        own = {key: v[PART[1], None, :] if v.ndim > 1 else v for key, v in self.values.items()}
        wo = from_angles(THETA[PART[0]], torch.tensor(0.5, dtype=torch.float64))[:, None, None, :]
        shape = (len(wo), len(WIDTH[PART[1]]), len(points), 3)
        u, wo = points.expand(*shape), wo.expand(*shape)
        wi = form.sample(own, wo, u)
        g = bc.geometry.geometry(wi, wo, form.needs | form.pdf_needs)
        density = form.pdf(own, g)[..., None]
        share = torch.where(density > 0, wi[..., 2:].clamp(min=0) / torch.where(density > 0, density, 1.0), 0.0)
        return (form.f(own, g) * share).mean((-2, -1))


def table(text: str, axes: dict[str, torch.Tensor]) -> Table:
    material = bc.material(text)
    label = material.form.terms[0].label
    values = {key: value.detach().double() for key, value in material.values().items()}
    return Table(material, values | {f"{label}.{name}": axis[:, None] for name, axis in axes.items()})


def scrambled(count: int, seed: int) -> torch.Tensor:
    return torch.quasirandom.SobolEngine(3, scramble=True, seed=seed).draw(count, dtype=torch.float64)


def compared(made: Table, tolerance: float, show, name: str) -> float:
    """How often our time goes into the peer's at equal accuracy."""
    with torch.no_grad():
        found = made.albedos(tolerance)
        assert found.met
        exact = made.albedos(1e-3 * tolerance).values[PART][..., 0]
        errors = []
        for count in POINTS:
            drawn = torch.stack([made.drawn(scrambled(count, seed)) - exact for seed in range(SCRAMBLES)])
            errors.append(drawn.square().mean(0).sqrt())
        overall = [float(error.square().mean().sqrt()) for error in errors]
        power = math.log(overall[0] / overall[1]) / math.log(POINTS[1] / POINTS[0])
        power = min(max(power, SLOWEST), FASTEST)
        points = float((POINTS[1] * (SURE * errors[1] / tolerance) ** (1 / power)).clamp(min=LEAST).mean())
        whole = ANGLES * WIDTHS / exact.numel()
        drawing = scrambled(POINTS[1], 0)
        times = ratio(lambda: made.drawn(drawing), lambda: made.albedos(tolerance)) * whole * points / POINTS[1]
        begun = time.perf_counter()
        made.albedos(tolerance)
        seconds = time.perf_counter() - begun
    show(
        f"{name}, {ANGLES} x {WIDTHS} to {tolerance:g}: {1e3 * seconds:.0f} ms, {found.evaluations / 1e6:.2f} million "
        f"evaluations; Sobol {times:.3g}x the time (its error falls like N^-{power:.2f}: {points:.2g} points an entry)"
    )
    return times


def test_the_bounded_lobe(show):
    assert compared(table("ward_bounded(rs=1)", {"a": WIDTH}), 1e-7, show, "ward_bounded") >= 300


@pytest.mark.parametrize("text", CASES)
def test_half_vector_lobes(text, show):
    assert compared(table(text, CASES[text]), 1e-6, show, text) >= 30
