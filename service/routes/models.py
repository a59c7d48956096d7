"""GET /v1/models: what the text of a fit may name."""

import dataclasses

from fastapi import APIRouter, Depends

import brdfcore as bc

from ..errors import responses
from ..schemas import ModelList, ModelView, PresetView
from ._http import json_accepted

router = APIRouter(prefix="/v1/models", tags=["models"], dependencies=[Depends(json_accepted)])


@router.get("", responses=responses(406))
async def models() -> ModelList:
    """Every model: what it is, its formula, options, and parameters with their boxes; and every preset."""
    return ModelList(
        items=[ModelView(**model.describe()) for model in bc.MODELS.values()],
        presets=[PresetView(**dataclasses.asdict(preset)) for preset in bc.PRESETS.values()],
    )
