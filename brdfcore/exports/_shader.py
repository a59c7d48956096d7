"""A material as code: its terms as routines, its values as named constants, and the same code run by torch."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from ..models.form import Term
from ..models.material import Material
from ..models.text import Tie
from ._export import check_channels
from ._language import LIBRARY, Routine, number, pruned, to_glsl, to_python, used
from ._terms import GEOMETRY, TermSource, term_source

LEAST = 1e-6  # cosine below which a lobe is evaluated at it: what is divided by stays within single precision

_GEOMETRY = Routine(
    "geometry",
    ("xi", "yi", "zi", "xo", "yo", "zo"),
    f"""
    ci = max(zi, {LEAST!r})
    co = max(zo, {LEAST!r})
    hz = ci + co
    p = (xi + xo) / hz
    q = (yi + yo) / hz
    e2 = sq(p) + sq(q)
    c2 = 1.0 + e2
    hd = 0.5 * hz * sqrt(c2)
    """,
    GEOMETRY,
)
_MIRROR = Routine(
    "mirror",
    ("xo", "yo", "co", "p", "q"),
    "along = 2.0 * (xo * p + yo * q + co) / (1.0 + sq(p) + sq(q))",
    ("along * p - xo", "along * q - yo", "along - co"),
)


@dataclass(frozen=True)
class Shader:
    """The code of a material of one channel or of three; values by name, as in "kurt_m"."""

    material: Material

    def __post_init__(self) -> None:
        channels = self.material.channels
        check_channels(channels)
        _ = self._sources  # what no shader can hold is refused here

    @cached_property
    def values(self) -> dict[str, float | list[float]]:
        """Every free value by its name in the code: a number, or red, green and blue."""
        return {_variable(key): value.detach().tolist() for key, value in self.material.values().items()}

    @cached_property
    def _sources(self) -> list[tuple[Term, TermSource]]:
        terms = self.material.form.terms
        return [(term, term_source(term.model, self._coloured(term))) for term in terms]

    def _coloured(self, term: Term) -> frozenset[str]:
        """The parameters of a term that have a value a channel."""
        resolved = self.material.form.of_term(term, self.material.values())
        return frozenset(name for name, value in resolved.items() if value.ndim and value.numel() > 1)

    @property
    def coloured(self) -> bool:
        """Whether the BRDF is red, green and blue; else it is one number."""
        return any(self._coloured(term) for term, _ in self._sources)

    def _routine(self, what: str, term: Term, lines: str, result: str) -> Routine:
        """The routine of a term, over those of the geometry and of its parameters that it reads."""
        lines = pruned(lines, result)
        read = Routine("", (), lines, (result,)).names - {name for name, _ in Routine("", (), lines, ()).assignments}
        arguments = (*(g for g in GEOMETRY if g in read), *(n for n in term.model.parameter if n in read))
        coloured = self._coloured(term) & set(arguments) if what == "brdf" else frozenset()
        return Routine(f"{what}_{term.label}", arguments, lines, (result,), frozenset(coloured))

    @cached_property
    def lobes(self) -> list[Routine]:
        """A routine a term, which gives f [1/sr]."""
        found = []
        for term, source in self._sources:
            parts = zip(source.coefficients, source.bases, strict=True)
            result = " + ".join(f"{coefficient} * ({basis})" for coefficient, basis in parts)
            found.append(self._routine("brdf", term, source.lines, result))
        return found

    @cached_property
    def densities(self) -> list[Routine]:
        """A routine a term, which gives the density of its sampler [1/sr]."""
        return [self._routine("density", term, source.lines, source.density) for term, source in self._sources]

    @cached_property
    def samplers(self) -> list[Routine]:
        """A routine a term, which draws a direction."""
        found = []
        for term, source in self._sources:
            made = Routine("", (), source.sampler, ())
            read = {name for _, expression in made.assignments for name in Routine("", (), "", (expression,)).names}
            parameters = [n for n in term.model.parameter if n in read]
            ends = ("mirror(xo, yo, co, p, q)",) if source.by_slopes else ("x", "y", "z")
            arguments = ("xo", "yo", "co", "u", "v", *parameters)
            found.append(Routine(f"draw_{term.label}", arguments, source.sampler, ends))
        return found

    @cached_property
    def shares(self) -> list[float]:
        """The probability with which each term is sampled."""
        shares: list[float] = self.material.form.shares(self.material.values()).tolist()
        return shares

    def calls(self, routines: list[Routine], value: Callable[[str], str]) -> list[str]:
        """A call of each routine, one a term; `value` is how a value is written, by its name."""
        ties = self.material.form.ties
        found = []
        for term, routine in zip(self.material.form.terms, routines, strict=True):
            arguments = []
            for name in routine.arguments:
                key = f"{term.label}.{name}"
                is_value = name in term.model.parameter
                arguments.append(_argument(key, ties.get(key), value) if is_value else name)
            found.append(f"{routine.name}({', '.join(arguments)})")
        return found

    def library(self, routines: list[Routine]) -> list[Routine]:
        """The shared routines that these need."""
        return used(frozenset[str]().union(*(r.names for r in routines)), LIBRARY)

    def python(self) -> str:
        """Python code over the language's primitives: `brdf`, `density` and `draw` of directions and values."""
        routines = [_GEOMETRY, _MIRROR, *self.lobes, *self.densities, *self.samplers]

        def value(name: str) -> str:
            return f'values["{name}"]'

        given = "xi, yi, zi, xo, yo, zo"
        unpacked = f"    {', '.join(GEOMETRY)} = geometry({given})"
        weighted = [f"{s!r} * {c}" for s, c in zip(self.shares, self.calls(self.densities, value), strict=True)]
        draws = [f"    x, y, z = {call}" for call in self.calls(self.samplers, value)[-1:]]
        upper = 1.0
        for share, call in reversed(list(zip(self.shares[1:], self.calls(self.samplers, value)[:-1], strict=True))):
            upper -= share
            draws.append(f"    a, b, c = {call}")
            draws.append(f"    first = which < {upper!r}")
            draws.append("    x, y, z = choose(first, a, x), choose(first, b, y), choose(first, c, z)")
        parts = [
            *(to_python(routine) for routine in [*self.library(routines), *routines]),
            f"def brdf({given}, values):\n{unpacked}\n    return {_sum(self.calls(self.lobes, value))}",
            f"def density({given}, values):\n{unpacked}\n    return {_sum(weighted)}",
            f"def draw(xo, yo, zo, which, u, v, values):\n    co = max(zo, {LEAST!r})\n"
            + "\n".join(draws)
            + "\n    return x, y, z",
        ]
        return "\n\n\n".join(parts) + "\n"

    def glsl(self) -> str:
        """GLSL code: the routines, and `vec3 brdf(float xi, ..., float zo)` over the values as globals."""
        routines = [*self.library([_GEOMETRY, *self.lobes]), *self.lobes]
        geometry = "\n".join(f"    float {name} = {expression};" for name, expression in _GEOMETRY.assignments)
        total = _sum(self.calls(self.lobes, lambda name: name))
        body = (
            "vec3 brdf(float xi, float yi, float zi, float xo, float yo, float zo) {\n"
            f"{geometry}\n    return {total if self.coloured else f'vec3({total})'};\n}}"
        )
        return "\n\n".join([*(to_glsl(routine) for routine in routines), body]) + "\n"

    def f(self, wi: Tensor, wo: Tensor) -> Tensor:
        """The BRDF [1/sr], (..., C), that the Python code computes; 0 below the horizon."""
        found = self._run("brdf", *wi.split(1, -1), *wo.split(1, -1))
        return torch.where((wi[..., 2:] > 0) & (wo[..., 2:] > 0), found, 0.0)

    def pdf(self, wi: Tensor, wo: Tensor) -> Tensor:
        """The density [1/sr], (...), that the Python code computes; 0 below the horizon."""
        found = self._run("density", *wi.split(1, -1), *wo.split(1, -1))
        return torch.where((wi[..., 2:] > 0) & (wo[..., 2:] > 0), found, 0.0)[..., 0]

    def sample(self, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3) that the Python code draws."""
        return torch.cat(torch.broadcast_tensors(*self._run("draw", *wo.split(1, -1), *u.split(1, -1))), -1)

    def _run(self, name: str, *arguments: Tensor) -> Any:
        values = {key: torch.as_tensor(value, dtype=arguments[0].dtype) for key, value in self.values.items()}
        return self._namespace[name](*arguments, values)

    @cached_property
    def _namespace(self) -> dict[str, Any]:
        namespace: dict[str, Any] = dict(_TORCH)
        exec(compile(self.python(), "<shader>", "exec"), namespace)  # noqa: S102 - the code that was made above
        return namespace


def _argument(key: str, tie: Tie | None, value: Callable[[str], str]) -> str:
    if tie is None:
        return value(_variable(key))
    owner = value(_variable(tie.owner))
    if tie.total is None:
        return owner
    return f"{number(list(tie.total) if len(tie.total) > 1 else tie.total[0])} - {owner}"


def _variable(key: str) -> str:
    return key.replace(".", "_")


def _sum(parts: list[str]) -> str:
    return "(" + "\n        + ".join(parts) + ")" if len(parts) > 1 else parts[0]


def _tensor(x: Tensor | float) -> Tensor:
    return torch.as_tensor(x, dtype=None if isinstance(x, Tensor) else torch.float64)


def _like(function: Callable[[Tensor, Tensor], Tensor]) -> Callable[[Any, Any], Tensor]:
    """A function of two tensors for numbers too."""

    def of_either(x: Tensor | float, y: Tensor | float) -> Tensor:
        tensor = x if isinstance(x, Tensor) else y
        if not isinstance(tensor, Tensor):
            return function(_tensor(x), _tensor(y))
        return function(torch.as_tensor(x).to(tensor), torch.as_tensor(y).to(tensor))

    return of_either


def _vec3(*parts: Tensor | float) -> Tensor:
    """Three columns (N, 1) side by side, or three numbers as one colour (3,)."""
    tensors = [part for part in parts if isinstance(part, Tensor)]
    return torch.cat(tensors, -1) if tensors else torch.tensor(parts, dtype=torch.float64)


_TORCH: Mapping[str, Any] = {
    "PI": math.pi,
    **{name: getattr(torch, name) for name in ("exp", "log", "sqrt", "sin", "cos", "erf")},
    "pow": _like(torch.pow),
    "atan": _like(torch.atan2),
    "max": _like(torch.maximum),
    "min": _like(torch.minimum),
    "choose": lambda condition, then, other: torch.where(condition, then, other),
    "vec3": _vec3,
}
