"""MERL's `.binary`: the material's values at the centres of 90 x 90 x 180 bins (formats/merl.py has the layout).

The table is isotropic and reciprocal by construction, so materials that are not are refused. Bins with a direction
below the horizon at their centre hold -1 in every plane, as in the database. The layout has no room for a comment. The
difference is that of a program which looks up the nearest bin, as the database's own BRDFRead.cpp does: it is large for
lobes narrower than a bin. At the bins' centres, `bc.read` returns the material's values to 2 ulp.
"""

import numpy as np
import torch

from ..errors import InvalidValueError
from ..formats import merl
from ..models.material import Material
from ._difference import nodes
from ._export import Export, Exporter, Orientation, check_channels
from ._symmetry import is_isotropic

_CHUNK = 2**17  # bins that are evaluated at once


def write(material: Material, name: str, orientation: Orientation | None) -> Export:
    """The file's bytes, 35 MB, for an isotropic, reciprocal material of one channel or three."""
    check_channels(material.channels)
    for term in material.form.terms:
        if not term.model.reciprocal:
            raise InvalidValueError(
                f"Expected the material to be reciprocal for a MERL table, got {term.label}, which is not. "
                "Export it to a shader, or fit another lobe.",
                field="material",
            )
    if not is_isotropic(material):
        raise InvalidValueError(
            "Expected the material to be isotropic for a MERL table, got an anisotropic one. "
            "Export it to a shader, or fit an isotropic lobe.",
            field="material",
        )
    wi, wo, _ = merl.grid()
    above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    values = np.full((3, len(wi)), -1.0)
    with torch.no_grad():
        for rows in np.array_split(np.flatnonzero(above), max(1, len(wi) // _CHUNK)):
            f = material.f(torch.from_numpy(wi[rows]), torch.from_numpy(wo[rows]))
            values[:, rows] = f.expand(len(rows), 3).numpy().T / np.array(merl.SCALE)[:, None]
    at = nodes(material)
    looked_up = values[:, merl.bins(at.wi.numpy(), at.wo.numpy())].T * merl.SCALE
    found = at.difference(torch.from_numpy(np.where(looked_up < 0, 0.0, looked_up)))
    content = np.array(merl.SHAPE, "<i4").tobytes() + values.astype("<f8").tobytes()
    return Export("merl", content, found, "MERL table of 90 x 90 x 180 bins, looked up at the nearest bin.")


EXPORT = Exporter(
    name="merl",
    description="MERL .binary, a table of 90 x 90 x 180 bins; isotropic, reciprocal materials",
    suffix=".binary",
    media_type="application/octet-stream",
    write=write,
)
