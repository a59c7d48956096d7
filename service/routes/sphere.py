"""POST /v1/sphere: a lit sphere of a material, at once."""

import asyncio

import torch
from fastapi import APIRouter, Request, Response

from brdfcore.errors import InvalidValueError
from brdfcore.render import lit_sphere, to_rgb
from brdfcore.render.image import encoded, png

from ..errors import inlined, responses
from ..materials import material_of
from ..schemas import SphereRequest
from ..state import state
from ._http import json_content, parsed, require_accepted

router = APIRouter(tags=["materials"])

_JSON_LIMIT = 2**18  # bytes
_MOST = 64  # channels; each may be a lobe of its own
_BODY = {"required": True, "content": {"application/json": {"schema": inlined(SphereRequest)}}}
_IMAGE = {"content": {"image/png": {"schema": {"format": "binary"}}}}


@router.post(
    "/v1/sphere",
    response_class=Response,
    responses={200: _IMAGE, **responses(406, 408, 413, 415, 422)},
    openapi_extra={"requestBody": _BODY},
)
async def sphere(request: Request) -> Response:
    """Draw a lit sphere of a material as PNG: in colour where its channels have one, else a channel of it in gray."""
    require_accepted(request, "image/png")
    content = await json_content(request, _JSON_LIMIT)
    asked = await asyncio.to_thread(parsed, SphereRequest, content)
    loop = asyncio.get_running_loop()
    return Response(await loop.run_in_executor(state(request).computing, _drawn, asked), media_type="image/png")


def _drawn(asked: SphereRequest) -> bytes:
    material = material_of(asked.material)
    names = asked.channels or [str(k) for k in range(material.channels)]
    if material.channels > _MOST:
        raise InvalidValueError(
            f"Expected material to have at most {_MOST} channels, got {material.channels}. Leave some out.",
            field="material",
        )
    if material.channels not in (1, len(names)):
        raise InvalidValueError(
            f"Expected channels to name the material's {material.channels}, got {len(names)}. Name each once.",
            field="channels",
        )
    if asked.channel >= len(names):
        raise InvalidValueError(
            f"Expected channel to be below {len(names)}, got {asked.channel}. They are counted from 0.", field="channel"
        )
    with torch.no_grad():
        pixels = lit_sphere(material, asked.size)
        rgb = to_rgb(pixels, names)
        if rgb is None:
            shown = min(asked.channel, pixels.shape[-1] - 1)
            rgb = pixels[..., shown : shown + 1].expand(*pixels.shape[:-1], 3)
    return png(encoded(rgb, 1.0))
