"""JSON: the material's own, exact, with its text and what wrote it. `Material.from_json` reads it back."""

import json

from ..models.material import Material
from ._difference import difference
from ._export import Export, Exporter, Orientation, provenance, told


def write(material: Material, name: str, orientation: Orientation | None) -> Export:
    """The JSON text, of any material."""
    data = material.to_json()
    found = difference(material, Material.from_json(json.loads(json.dumps(data))).f)
    holds = "The material as brdfcore keeps it."
    about = {"text": str(material), "written_by": provenance(), "difference": told(found)}
    return Export("json", json.dumps({**about, **data}, indent=2) + "\n", found, holds)


EXPORT = Exporter(
    name="json",
    description="JSON with structure and values, exact for every material; Material.from_json reads it",
    suffix=".json",
    media_type="application/json",
    write=write,
)
