"""What models need to know of a pair of directions, each quantity computed only when it is asked for.

    H = wi + wo,  p = Hx/Hz,  q = Hy/Hz,  e2 = p^2 + q^2 = tan^2 theta_h,  h.wo = |H|/2

Everything follows from the half vector's slopes, so no angle is computed and nothing is lost near the normal or at
the horizon (tests/test_geometry.py). Inputs are made safe here once: a pair with a direction at or below the horizon
is evaluated at the normal and masked afterwards, and a cosine below `FLOOR` is evaluated there. That floor (9e-13 for
float32, 7e-49 for float64) keeps what models divide by, and the gradients, within the type; it lies far under the
rounding of a unit vector's components.

For float32 directions these few additions and divisions are done in float64 and rounded once, and what models would
divide by comes as a reciprocal, whose own derivative is then float64's affair. So a partial derivative of a model never
exceeds twice its value, and no overflow meets a factor that is exactly 0 and makes a NaN.
"""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, cast

import torch
from torch import Tensor

from ._types import Directions, Mask, Quantity
from .errors import InvalidValueError

FLOOR = {torch.float32: 2.0**-40, torch.float64: 2.0**-160}

_NOT_ASKED_FOR = cast(Tensor, None)  # arithmetic with a quantity that `needs` does not name fails at once


class Geometry(NamedTuple):
    """The quantities that were asked for, each (..., 1); a plain tuple of tensors, so it crosses vmap and compile."""

    above: Mask  # both directions above the horizon
    xi: Quantity = _NOT_ASKED_FOR  # the horizontal components of wi
    yi: Quantity = _NOT_ASKED_FOR
    xo: Quantity = _NOT_ASKED_FOR  # and of wo
    yo: Quantity = _NOT_ASKED_FOR
    ci: Quantity = _NOT_ASKED_FOR  # cos theta_i
    co: Quantity = _NOT_ASKED_FOR  # cos theta_o
    over_ci: Quantity = _NOT_ASKED_FOR  # 1 / cos theta_i; models multiply by reciprocals, see above
    over_co: Quantity = _NOT_ASKED_FOR  # 1 / cos theta_o
    over_hz: Quantity = _NOT_ASKED_FOR  # 1 / (ci + co), over the height of the unnormalised half vector
    p: Quantity = _NOT_ASKED_FOR  # slope of the half vector along x
    q: Quantity = _NOT_ASKED_FOR  # slope of the half vector along y
    e2: Quantity = _NOT_ASKED_FOR  # p^2 + q^2
    ux: Quantity = _NOT_ASKED_FOR  # the components of the unit half vector
    uy: Quantity = _NOT_ASKED_FOR
    uz: Quantity = _NOT_ASKED_FOR
    h_dot_wo: Quantity = _NOT_ASKED_FOR  # cosine between half vector and either direction
    over_h_dot_wo: Quantity = _NOT_ASKED_FOR  # its reciprocal


QUANTITIES = frozenset(Geometry._fields) - {"above"}


class _ToSingle(torch.autograd.Function):
    """The float32 of a float64 tensor; a gradient that overflowed comes back as the largest float32."""

    generate_vmap_rule = True

    @staticmethod
    def forward(x: Tensor) -> Tensor:
        return x.to(torch.float32)

    @staticmethod
    def setup_context(ctx: Any, inputs: tuple[Tensor], output: Tensor) -> None:
        """Keep nothing: neither derivative depends on the input."""

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        largest = torch.finfo(torch.float32).max
        return gradient.clamp(-largest, largest).to(torch.float64)

    @staticmethod
    def jvp(ctx: Any, tangent: Tensor) -> Tensor:
        return tangent.to(torch.float32)


def _to_single(x: Tensor) -> Tensor:
    return cast(Tensor, _ToSingle.apply(x))  # type: ignore[no-untyped-call]


class _once:  # noqa: N801  -- a decorator
    """A property that is computed once; functools' holds a lock up to Python 3.11, which torch.compile cannot enter."""

    def __init__(self, compute: Callable[[Any], Tensor]) -> None:
        self.compute = compute

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: object, owner: type) -> Tensor:
        value = self.compute(instance)
        instance.__dict__[self.name] = value
        return value


class _OnDemand:
    """Computes each quantity of a pair of float64 directions at most once."""

    def __init__(self, wi: Tensor, wo: Tensor, floor: float) -> None:
        self.above = ~((wi[..., 2:] <= 0) | (wo[..., 2:] <= 0))  # a NaN is not below: it goes on as NaN
        self.given = wi, wo
        self.floor = floor

    @_once
    def normal(self) -> Tensor:
        return self.given[0].new_tensor([0.0, 0.0, 1.0])

    @_once
    def wi(self) -> Tensor:
        return torch.where(self.above, self.given[0], self.normal)

    @_once
    def wo(self) -> Tensor:
        return torch.where(self.above, self.given[1], self.normal)

    @property
    def xi(self) -> Tensor:
        return self.wi[..., :1]

    @property
    def yi(self) -> Tensor:
        return self.wi[..., 1:2]

    @property
    def xo(self) -> Tensor:
        return self.wo[..., :1]

    @property
    def yo(self) -> Tensor:
        return self.wo[..., 1:2]

    @_once
    def ci(self) -> Tensor:
        return self.wi[..., 2:].clamp(min=self.floor)

    @_once
    def co(self) -> Tensor:
        return self.wo[..., 2:].clamp(min=self.floor)

    @_once
    def hz(self) -> Tensor:
        return self.ci + self.co

    @_once
    def over_ci(self) -> Tensor:
        return self.ci.reciprocal()

    @_once
    def over_co(self) -> Tensor:
        return self.co.reciprocal()

    @_once
    def over_hz(self) -> Tensor:
        return self.hz.reciprocal()

    @_once
    def over_h_dot_wo(self) -> Tensor:
        return self.h_dot_wo.reciprocal()

    @_once
    def hx(self) -> Tensor:
        return self.xi + self.xo

    @_once
    def hy(self) -> Tensor:
        return self.yi + self.yo

    @_once
    def p(self) -> Tensor:
        return self.hx / self.hz

    @_once
    def q(self) -> Tensor:
        return self.hy / self.hz

    @_once
    def e2(self) -> Tensor:
        return self.p.square() + self.q.square()

    @property
    def ux(self) -> Tensor:
        return self.hx / self.norm

    @property
    def uy(self) -> Tensor:
        return self.hy / self.norm

    @property
    def uz(self) -> Tensor:
        return self.hz / self.norm

    @_once
    def norm(self) -> Tensor:
        return torch.sqrt(self.hx.square() + self.hy.square() + self.hz.square())

    @_once
    def h_dot_wo(self) -> Tensor:
        return 0.5 * self.norm


def geometry(wi: Directions, wo: Directions, needs: Iterable[str]) -> Geometry:
    """The quantities that `needs` names, for directions of one floating dtype; raises for other dtypes and shapes."""
    check_directions("wi", wi)
    check_directions("wo", wo)
    check_broadcast("wi and wo", wi, wo, field="wo")
    dtype = torch.promote_types(wi.dtype, wo.dtype)
    on_demand = _OnDemand(wi.double(), wo.double(), FLOOR[dtype])
    quantities = {name: getattr(on_demand, name) for name in needs}
    if dtype == torch.float32:
        quantities = {name: _to_single(quantity) for name, quantity in quantities.items()}
    return Geometry(above=on_demand.above, **quantities)


def check_directions(name: str, w: Tensor) -> None:
    """Raise InvalidValueError where w is no float32 or float64 tensor of shape (..., 3)."""
    if not isinstance(w, Tensor):
        raise InvalidValueError(
            f"Expected {name} to be a tensor, got {type(w).__name__}. Convert it with torch.as_tensor({name}).",
            field=name,
        )
    if w.ndim == 0 or w.shape[-1] != 3:
        raise InvalidValueError(
            f"Expected {name} to be unit vectors on a last axis of length 3, got shape {tuple(w.shape)}. "
            "Pass directions as (..., 3).",
            field=name,
        )
    if w.dtype not in FLOOR:
        raise InvalidValueError(
            f"Expected {name} to be float32 or float64, got {w.dtype}. Convert it with {name}.float().", field=name
        )


def check_broadcast(names: str, *tensors: Tensor, field: str) -> None:
    """Raise InvalidValueError where tensors, in words `names`, have shapes that do not broadcast."""
    shapes = [tuple(tensor.shape) for tensor in tensors]
    if len(set(shapes)) > 1:
        try:
            torch.broadcast_shapes(*shapes)
        except RuntimeError:
            raise InvalidValueError(
                f"Expected {names} to have shapes that broadcast, got {' and '.join(map(str, shapes))}. "
                "Make their leading axes equal, or of length 1.",
                field=field,
            ) from None


def from_angles(theta: Tensor, phi: Tensor) -> Directions:
    """Unit vectors (..., 3) of polar angle theta and azimuth phi [radians]."""
    theta, phi = torch.broadcast_tensors(theta, phi)
    sine = torch.sin(theta)
    return torch.stack([sine * torch.cos(phi), sine * torch.sin(phi), torch.cos(theta)], dim=-1)


def reflect(wo: Directions, p: Quantity, q: Quantity) -> Directions:
    """The direction that mirrors wo at the half vector of slopes p, q: 2 (h.wo) h - wo, shape (..., 3)."""
    h = torch.cat(torch.broadcast_tensors(p, q, torch.ones_like(p)), dim=-1)
    return 2 * (h * wo).sum(-1, keepdim=True) / h.square().sum(-1, keepdim=True) * h - wo
