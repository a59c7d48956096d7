"""A measured grid as a material: evaluated between its nodes, sampled by its own table."""

import math
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Final

import numpy as np
import torch
from torch import Tensor

from .._types import Density, Directions, Spectrum
from ..errors import FormatError
from ..formats import HEAD, detect, rgl
from ..geometry import check_directions
from ._grid import Grid
from .merl import MerlGrid

GRIDDED: Final[Mapping[str, Callable[[Path], Grid]]] = {"merl": MerlGrid.load, "rgl": rgl.load}

DIFFUSE = 0.25  # share of the samples that follow the cosine, so that no weight is large where the table's own are few
_CHUNK = 2**14  # pairs that are looked up at once: 100 MB


class Tabulated:
    """A measured BRDF, as `bc.Tabulated.read(path)` gives it; no parameters and no derivatives.

    f, pdf, sample and weight are as in `Material`, for directions (..., 3) of one floating dtype, which the results
    keep; they are computed in double precision on the CPU. f is the measurement, interpolated: it may be slightly
    negative where the file is, and slightly unequal with wi and wo exchanged. `sample` draws wi for wo as the file
    draws outgoing directions, which is as good as the material is reciprocal; `pdf` is its true density either way.
    """

    def __init__(self, grid: Grid, name: str = "measured", path: Path | None = None) -> None:
        self.grid = grid
        self.name = name
        self.path = path  # of the file that it was read from

    @classmethod
    def read(cls, path: str | PathLike[str]) -> "Tabulated":
        """The material of a MERL or RGL file; FormatError where it is none, or not whole."""
        file = Path(path)
        try:
            with file.open("rb") as opened:
                name = detect(opened.read(HEAD))
            if name not in GRIDDED:
                raise FormatError(
                    f"Expected a file that is a grid ({' or '.join(GRIDDED)}), got {name}. Fit it with bc.fit.",
                    field="path",
                )
            return cls(GRIDDED[name](file), file.name, file)
        except OSError as error:
            raise FormatError(
                f"Expected path to be a readable file, got {file.name!r} ({error.strerror}). Check the path.",
                field="path",
            ) from error

    @property
    def channels(self) -> int:
        """How many channels were measured."""
        return len(self.grid.channels)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """The channels' names."""
        return self.grid.channels

    def __str__(self) -> str:
        return self.name

    def f(self, wi: Directions, wo: Directions) -> Spectrum:
        """The BRDF [1/sr], (..., C); exactly 0 where a direction is not above the horizon."""
        return self._over(self.grid.f, self.channels, wi, wo)

    def pdf(self, wi: Directions, wo: Directions) -> Density:
        """The density with which `sample` draws wi for wo, per solid angle [1/sr], (...)."""

        def mixed(incident: "np.ndarray", seen: "np.ndarray") -> "np.ndarray":
            own = self.grid.pdf(seen, incident)
            found: np.ndarray = DIFFUSE * incident[:, 2] / math.pi + (1 - DIFFUSE) * own
            return found[:, None]

        return self._over(mixed, 1, wi, wo).squeeze(-1)

    def sample(self, wo: Directions, u: Directions) -> Directions:
        """Directions wi (..., 3) drawn for wo, from u (..., 3) uniform in [0, 1).

        A wi may lie below the horizon: its weight is 0 and it must not be drawn again.
        """
        check_directions("wo", wo)
        given, numbers = torch.broadcast_tensors(wo, u)
        normal = given.new_tensor([0.0, 0.0, 1.0])
        flat = torch.where(given[..., 2:] > 0, given, normal).detach().reshape(-1, 3).double().cpu().numpy()
        which, s, t = numbers.detach().reshape(-1, 3).double().cpu().numpy().T
        own = np.concatenate([self.grid.sample(flat[rows], s[rows], t[rows]) for rows in _rows(len(flat))] or [flat])
        radius, phi = np.sqrt(s), 2 * math.pi * t
        diffuse = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1 - s)], -1)
        drawn = np.where((which < DIFFUSE)[:, None], diffuse, own)
        return torch.from_numpy(drawn).to(given).reshape(given.shape)

    def weight(self, wi: Directions, wo: Directions) -> Spectrum:
        """The quotient f cos theta_i / pdf [1], (..., C), which a sample contributes; 0 where the density is."""
        density = self.pdf(wi, wo).unsqueeze(-1)
        empty = density == 0
        return torch.where(empty, 0.0, self.f(wi, wo) * wi[..., 2:] / torch.where(empty, 1.0, density))

    def _over(
        self,
        function: "Callable[[np.ndarray, np.ndarray], np.ndarray]",
        columns: int,
        wi: Tensor,
        wo: Tensor,
    ) -> Tensor:
        """A function of flat arrays, for tensors of any shape: computed above the horizon, 0 elsewhere."""
        check_directions("wi", wi)
        check_directions("wo", wo)
        incident, seen = torch.broadcast_tensors(wi, wo)
        above = ((incident[..., 2] > 0) & (seen[..., 2] > 0)).reshape(-1).cpu().numpy()
        a, b = (w.detach().reshape(-1, 3).double().cpu().numpy() for w in (incident, seen))
        found = np.zeros((len(above), columns))
        places = np.flatnonzero(above)
        for rows in _rows(len(places)):
            at = places[rows]
            found[at] = function(a[at], b[at])
        dtype = torch.promote_types(wi.dtype, wo.dtype)
        return torch.from_numpy(found).to(wi.device, dtype).reshape(*incident.shape[:-1], columns)


def _rows(count: int) -> list[slice]:
    return [slice(start, start + _CHUNK) for start in range(0, count, _CHUNK)]
