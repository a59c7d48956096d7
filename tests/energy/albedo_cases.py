"""Random materials of one term, angles and tolerances, for the tests of the directional albedo."""

import math
from typing import NamedTuple

import numpy as np
import torch

import brdfcore as bc
from brdfcore.models.form import Form, Term
from brdfcore.parameters import Parameter

CHOICES = [choice for model in bc.MODELS.values() for choice in model.choices()]
STEEPEST = 89.999  # degrees
# Results of the reference that differ by roundings may be told apart from their claims only above this.
FLOOR = 2.0**-52


class Case(NamedTuple):
    """A term with values, directions of wo, and a tolerance."""

    form: Form
    values: dict[str, torch.Tensor]
    co: torch.Tensor
    azimuth: torch.Tensor
    tolerance: float

    def albedo(self, tolerance: float | None = None, method: str = "auto") -> bc.Albedo:
        """Its albedo to its own or another tolerance."""
        tolerance = self.tolerance if tolerance is None else tolerance
        return bc.energy.of_form(self.form, self.values, self.co, self.azimuth, tolerance, method)


def form_of(choice: bc.Model) -> Form:
    """A form of this one term."""
    return Form((Term(choice.name, choice),))


def prepared(text: str) -> tuple[Form, dict[str, torch.Tensor]]:
    """The form and the values of a material's text."""
    material = bc.material(text)
    return material.form, {key: value.detach() for key, value in material.values().items()}


def _draw(parameter: Parameter, rng: np.random.Generator) -> torch.Tensor:
    low, high = (parameter.low, parameter.high) if rng.random() < 0.5 else parameter.search_range
    log = parameter.scale == "log"
    value = math.exp(rng.uniform(math.log(low), math.log(high))) if log else rng.uniform(low, high)
    return torch.tensor(min(max(value, parameter.low), parameter.high), dtype=torch.float64)


def random_case(rng: np.random.Generator, choice: bc.Model, directions: int) -> Case:
    """Values from the box or the search range, angles to 89.999 degrees with every distance from 90, a tolerance."""
    values = {f"{choice.name}.{p.name}": _draw(p, rng) for p in choice.parameters}
    even = rng.random(directions) < 0.5
    theta = np.where(even, rng.uniform(0, 90, directions), 90 - 10 ** rng.uniform(-3, 1.5, directions))
    theta = torch.tensor(np.minimum(theta, STEEPEST)).deg2rad()
    azimuth = torch.tensor(rng.uniform(0, 2 * math.pi, directions))
    return Case(form_of(choice), values, torch.cos(theta), azimuth, float(10 ** rng.uniform(-12, -2)))
