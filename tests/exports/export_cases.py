"""What the export tests share: every model, directions, and a reader of the GLSL that is generated."""

import functools
import math
import re

import numpy as np
import pytest
import torch

import brdfcore as bc
from brdfcore.hard_cases import covering
from brdfcore.hard_cases.catalogue import form_of

# every choice at the full tier; by default enough of them that each word of each model is tested
_COVERING = [choice for model in bc.MODELS.values() for choice in covering(model)]
CHOICES = [
    pytest.param(
        choice,
        id=f"{choice.name}({','.join(choice.options)})",
        marks=() if choice in _COVERING else pytest.mark.full,
    )
    for model in bc.MODELS.values()
    for choice in model.choices()
    if "compensated" not in choice.options
]
# the same, of which each model's first alone is tested by default
FIRST = [
    pytest.param(*case.values, id=case.id, marks=() if case.values[0] == model.choices()[0] else pytest.mark.full)
    for model in bc.MODELS.values()
    for case in CHOICES
    if case.values[0].name == model.name
]


def material_of(choice: bc.Model, *, coloured: bool = False) -> bc.Material:
    """A material of this one term, its values somewhat off their defaults, all that may have colour coloured."""
    values: dict[str, object] = {}
    for k, p in enumerate(choice.parameters):
        value = min(p.default * (1.1 + 0.3 * k), p.high) if p.default else p.low
        values[f"{choice.name}.{p.name}"] = (
            [value, 0.9 * value, max(0.5 * value, p.low)] if coloured and p.per_channel != "no" else value
        )
    return bc.Material(form_of(choice), values)


def directions(rng: np.random.Generator, count: int, least: float = 0.0) -> torch.Tensor:
    """Unit vectors (count, 3), uniform over the hemisphere above a cosine."""
    z, phi = rng.uniform(least, 1, count), rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(1 - z * z)
    return torch.tensor(np.stack([r * np.cos(phi), r * np.sin(phi), z], -1))


class Vec3(tuple):
    """GLSL's vec3, as far as it is used."""

    __slots__ = ()

    def _with(self, other, operation):
        others = other if isinstance(other, Vec3) else (other,) * 3
        return Vec3(operation(a, b) for a, b in zip(self, others, strict=True))

    def __add__(self, other):
        return self._with(other, lambda a, b: a + b)

    def __mul__(self, other):
        return self._with(other, lambda a, b: a * b)

    def __truediv__(self, other):
        return self._with(other, lambda a, b: a / b)

    def __sub__(self, other):
        return self._with(other, lambda a, b: a - b)

    def __rsub__(self, other):
        return self._with(other, lambda a, b: b - a)

    __radd__, __rmul__ = __add__, __mul__


def _vec3(*parts):
    return Vec3(parts * 3 if len(parts) == 1 else parts)


@functools.lru_cache(2)
def _compiled(text: str):
    parameters = re.search(r"::begin parameters\n(.*)\n::end parameters", text, re.DOTALL)[1]
    code = re.search(r"::begin shader\n(.*)::end shader", text, re.DOTALL)[1]
    namespace = {name: getattr(math, name) for name in ("exp", "sqrt", "sin", "cos", "pow")}
    namespace |= {
        "vec3": _vec3,
        "max": max,
        "min": min,
        "abs": abs,
        "atan": math.atan2,
        "sign": lambda x: math.copysign(1, x),
        "log": lambda x: math.log(x) if x > 0 else -math.inf,
        "dot": lambda a, b: sum(x * y for x, y in zip(a, b, strict=True)),
    }
    for line in parameters.splitlines():
        kind, name, *numbers = line.split()
        numbers = [float(n) for n in numbers]
        assert kind == "color" or numbers[0] <= numbers[2] <= numbers[1]
        namespace[name] = _vec3(*numbers) if kind == "color" else numbers[2]
    code = re.sub(r"const float (.*);", r"\1", code)
    code = re.sub(r"^(?:float|vec3) (\w+)\((.*)\) \{$", lambda m: f"def {m[1]}({_untyped(m[2])}):", code, flags=re.M)
    code = re.sub(r"^    float ", "    ", code, flags=re.M)
    code = re.sub(r"if \((.*)\) \{", r"if \1:", code).replace("||", "or")
    code = re.sub(r"return condition \? then : other", "return then if condition else other", code)
    code = re.sub(r"^ *\}$", "", code, flags=re.M).replace(";", "")
    exec(compile(code, "<glsl>", "exec"), namespace)
    return namespace["BRDF"]


def _untyped(arguments: str) -> str:
    return ", ".join(a.split()[-1] for a in arguments.split(", ")) if arguments else ""


def glsl_f(text: str, wi: list[float], wo: list[float]) -> Vec3:
    """What the BRDF of a .brdf file's GLSL returns, in the frame of the surface."""
    x, y, z = _vec3(1.0, 0.0, 0.0), _vec3(0.0, 1.0, 0.0), _vec3(0.0, 0.0, 1.0)
    return _compiled(text)(_vec3(*wi), _vec3(*wo), z, x, y)
