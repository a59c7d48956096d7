"""GET /v1/formats: what an uploaded file may be."""

from fastapi import APIRouter, Depends

import brdfcore as bc

from ..errors import responses
from ..schemas import FormatList, FormatView
from ._http import json_accepted

router = APIRouter(prefix="/v1/formats", tags=["formats"], dependencies=[Depends(json_accepted)])


@router.get("", responses=responses(406))
async def formats() -> FormatList:
    """Every format that a dataset may have; a file is told by its content."""
    return FormatList(
        items=[
            FormatView(name=found.name, description=found.description, uploads="material" not in found.options)
            for found in bc.FORMATS.values()
        ]
    )
