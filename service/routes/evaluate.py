"""POST /v1/evaluate: a material's BRDF, density and weight at pairs of directions."""

import asyncio
import json

import torch
from fastapi import APIRouter, Depends, Request, Response

from brdfcore.energy._described import finite

from ..datasets import directions
from ..errors import ProblemError, inlined, responses
from ..materials import material_of
from ..schemas import EvaluationRequest, EvaluationView
from ..state import state
from ._http import json_accepted, json_content, parsed

router = APIRouter(prefix="/v1/evaluate", tags=["materials"], dependencies=[Depends(json_accepted)])

_JSON_LIMIT = 4 * 2**20  # 10,000 rows of four angles or six components [bytes]
_MOST_NUMBERS = 1_000_000  # rows times terms and channels: about a second to compute and to write
_BODY = {"required": True, "content": {"application/json": {"schema": inlined(EvaluationRequest)}}}


@router.post(
    "",
    response_class=Response,
    responses={200: {"model": EvaluationView}, **responses(406, 408, 413, 415, 422)},
    openapi_extra={"requestBody": _BODY},
)
async def evaluate(request: Request) -> Response:
    """Evaluate a material at up to 10,000 pairs of directions: BRDF, density of its samples, and their weight."""
    content = await json_content(request, _JSON_LIMIT)
    service = state(request)
    loop = asyncio.get_running_loop()
    answer = await loop.run_in_executor(service.computing, _evaluated, content, service.settings.inline_rows)
    return Response(answer, media_type="application/json")


def _evaluated(content: bytes, most_rows: int) -> str:
    asked = parsed(EvaluationRequest, content)
    rows = len(asked.wi if asked.wi is not None else asked.theta_i_deg or [])
    if rows > most_rows:
        raise ProblemError(
            413,
            f"Expected at most {most_rows} pairs of directions, got {rows}. Send them in several requests.",
            field="wi" if asked.wi is not None else "theta_i_deg",
        )
    material = material_of(asked.material)
    columns = len(material.form.terms) + material.channels
    if rows * columns > _MOST_NUMBERS:
        raise ProblemError(
            422,
            f"Expected rows times terms and channels to be at most {_MOST_NUMBERS}, got {rows} times {columns}. "
            "Send fewer rows at once.",
            field="material",
        )
    wi, wo = directions(asked)
    with torch.no_grad():
        found = {"f": material.f(wi, wo), "pdf": material.pdf(wi, wo), "weight": material.weight(wi, wo)}
    found = {name: t.expand(rows, material.channels) if t.ndim == 2 else t for name, t in found.items()}
    view = {"material": str(material)} | {name: finite(t) for name, t in found.items()}
    return json.dumps(view, allow_nan=False)
