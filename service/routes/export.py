"""GET /v1/fits/{fit_id}/export/{format}: a fitted material as another program's file."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

import brdfcore as bc
from brdfcore.errors import unknown_name
from brdfcore.exports import EXPORTS, Export

from ..errors import responses
from ..state import state
from ._http import require_accepted
from ._jobs import Ranked, found, outcome_of, result_of

router = APIRouter(prefix="/v1/fits/{fit_id}/export", tags=["exports"])

_FILE = {
    "description": "the file",
    "content": {exporter.media_type: {} for exporter in EXPORTS.values()},
    "headers": {
        "x-brdf-difference": {
            "description": "relative RMS difference of f cos theta_i from the fitted material",
            "schema": {"type": "number"},
        },
        "x-brdf-holds": {"description": "what the file holds, in a sentence", "schema": {"type": "string"}},
    },
}


@router.get("/{format}", response_class=Response, responses={200: _FILE, **responses(404, 406, 409, 422)})
async def export(
    request: Request,
    fit_id: str,
    format: Annotated[str, Path(json_schema_extra={"enum": list(EXPORTS)})],  # noqa: A002 - the path's own name
    asked: Annotated[Ranked, Query()],
) -> Response:
    """The fitted material as a file for radiance, mitsuba, brdf_explorer, merl or json, its difference in a header."""
    if format not in EXPORTS:
        raise unknown_name("format", format, EXPORTS, field="format")
    exporter = EXPORTS[format]
    require_accepted(request, exporter.media_type)
    service = state(request)
    result = result_of(found(service, "fit", fit_id))
    made = await asyncio.get_running_loop().run_in_executor(service.computing, _exported, result, asked.rank, format)
    headers = {
        "content-disposition": f'attachment; filename="fit_{fit_id}{exporter.suffix}"',
        "x-brdf-difference": repr(made.difference),
        "x-brdf-holds": made.holds,
    }
    return Response(made.to_bytes(), headers=headers, media_type=exporter.media_type)


def _exported(result: str, rank: int, name: str) -> Export:
    return bc.export(bc.Material.from_json(outcome_of(result, rank).material), name)
