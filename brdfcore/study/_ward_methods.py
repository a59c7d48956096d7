"""The ways in which the study of evaluation evaluates Ward's lobe, and the directions for which it does."""

import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor

from ..geometry import from_angles, geometry
from ..models.material import Material, material
from ._textbook import Array, walter_3, walter_4, ward_5b

CHUNK = 65536  # directions: what a lobe computes of them fits the cache
RS = 0.3
STRETCH = 2.0  # ay / ax
EQ_3, EQ_4, APPROXIMATION = "NumPy, eq. 3 (textbook)", "NumPy, eq. 4", "NumPy, Ward's approximation"
EAGER, CHUNKED, COMPILED = "brdfcore, eager", "brdfcore, chunked", "brdfcore, compiled"
PRINTED = {EQ_3: walter_3, EQ_4: walter_4, APPROXIMATION: ward_5b}
_LOWEST = 1e-3  # cosine of either direction
_LONGEST = 20.0  # exponent: a value below exp(-20) of the peak matters to nobody

Evaluate = Callable[[Tensor, Tensor], Tensor]


@dataclass(frozen=True)
class Method:
    """One way to evaluate the lobe in one type."""

    name: str
    kind: str  # float32 or float64
    run: Callable[[], object]  # over all directions, to be timed
    values: Callable[[int], Array]  # of the first so many

    @property
    def label(self) -> str:
        """The name with the type."""
        return f"{self.name}, {self.kind}"


def ward(width: float) -> Material:
    """The lobe of ax = width."""
    return material(f"ward(rs={RS}, ax={width}, ay={STRETCH * width})")


def directions(width: float, count: int, seed: int) -> tuple[Tensor, Tensor]:
    """Directions wi, wo (count, 3) that the lobe draws, above the horizon and where it is not below exp(-20)."""
    generator = torch.Generator().manual_seed(seed)
    lobe = ward(width)
    pairs: list[tuple[Tensor, Tensor]] = []
    found = 0
    while found < count:
        u = torch.rand(2 * count, 5, dtype=torch.float64, generator=generator)
        wo = from_angles(torch.acos(_LOWEST + (1 - _LOWEST) * u[:, 3]), 2 * torch.pi * u[:, 4])
        with torch.no_grad():
            wi = lobe.sample(wo, u[:, :3])
        h = wi + wo
        exponent = ((h[:, 0] / width).square() + (h[:, 1] / (STRETCH * width)).square()) / h[:, 2].square()
        kept = (wi[:, 2] > _LOWEST) & (exponent < _LONGEST)
        pairs.append((wi[kept], wo[kept]))
        found += int(kept.sum())
    wi, wo = (torch.cat(parts)[:count].contiguous() for parts in zip(*pairs, strict=True))
    return wi, wo


def methods(width: float, wi: Tensor, wo: Tensor, *, compiled: bool) -> list[Method]:
    """Every way to evaluate the lobe, in both types."""
    lobe = ward(width)
    made = []
    for dtype, kind in ((torch.float64, "float64"), (torch.float32, "float32")):
        a, b = wi.to(dtype), wo.to(dtype)
        for name, printed in PRINTED.items():
            made.append(_in_numpy(name, kind, partial(printed, rs=RS, ax=width, ay=STRETCH * width), a, b))
        made.append(_in_torch(EAGER, kind, lobe.f, a, b))
        made.append(_in_torch(CHUNKED, kind, partial(_chunked, lobe), a, b))
        if compiled:
            made.append(_in_torch(COMPILED, kind, _compile(lobe, dtype), a, b))
    return made


def first_calls(among: Sequence[Method]) -> list[float]:
    """The seconds of the first call of each compiled method, which compiles it."""
    taken = []
    for method in among:
        if method.name == COMPILED:
            begun = time.perf_counter()
            method.run()
            taken.append(time.perf_counter() - begun)
    return taken


def has_compiler() -> bool:
    """Whether there is a C++ compiler for torch.compile."""
    return any(shutil.which(name) for name in ("c++", "g++", "clang++", "cl"))


def _in_numpy(name: str, kind: str, printed: Callable[[Array, Array], Array], wi: Tensor, wo: Tensor) -> Method:
    a, b = wi.numpy(), wo.numpy()
    return Method(name, kind, lambda: printed(a, b), lambda n: printed(a[:n], b[:n]))


def _in_torch(name: str, kind: str, evaluate: Evaluate, wi: Tensor, wo: Tensor) -> Method:
    def run() -> Tensor:
        with torch.no_grad():
            return evaluate(wi, wo)

    return Method(name, kind, run, lambda n: run()[:n, 0].numpy())


def _chunked(lobe: Material, wi: Tensor, wo: Tensor) -> Tensor:
    return torch.cat([lobe.f(a, b) for a, b in zip(wi.split(CHUNK), wo.split(CHUNK), strict=True)])


def _compile(lobe: Material, dtype: torch.dtype) -> Evaluate:
    """The lobe's pure function, compiled."""
    form = lobe.form
    values = {key: value.detach().to(dtype) for key, value in lobe.values().items()}
    compiled: Evaluate = torch.compile(lambda wi, wo: form.f(values, geometry(wi, wo, form.needs)), dynamic=False)
    return compiled
