"""POST /v1/datasets takes a measured file, GET /v1/datasets/{id} says what it holds."""

import asyncio
import functools
import hashlib
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from brdfcore.errors import BrdfError

from ..errors import ProblemError, responses
from ..schemas import DatasetView
from ..state import state
from ._http import chunks, json_accepted

router = APIRouter(prefix="/v1/datasets", tags=["datasets"], dependencies=[Depends(json_accepted)])
_ANY_BYTES = {"required": True, "content": {"application/octet-stream": {"schema": {"format": "binary"}}}}


class Declarations(BaseModel):
    """What a file does not say of itself."""

    model_config = ConfigDict(extra="forbid")

    format: str | None = Field(None, description="insists on a format; without it the content decides")
    quantity: str | None = Field(None, description="brdf, brdf_cos or reflectance_factor")
    angle_unit: str | None = Field(None, description="degrees or radians")
    columns: str | None = Field(
        None, max_length=2000, description="names of a table's columns, separated by commas, where it lacks them"
    )


@router.post(
    "",
    status_code=201,
    responses={200: {"model": DatasetView, "description": "known"}, **responses(406, 408, 413, 415, 422)},
    openapi_extra={"requestBody": _ANY_BYTES},
)
async def upload(request: Request, response: Response, declared: Annotated[Declarations, Query()]) -> DatasetView:
    """Read a measured file, sent as the plain body in any known format; its id comes from its content."""
    if request.headers.get("content-type", "").lower().startswith("multipart/"):
        raise ProblemError(415, "Expected the file itself as the body, got a form. Send it with curl --data-binary.")
    service = state(request)
    digest = hashlib.sha256()
    with service.datasets.incoming() as folder:
        with (folder / "data").open("wb") as file:
            async for piece in chunks(request, service.settings.upload_limit):
                digest.update(piece)
                file.write(piece)
        add = functools.partial(service.datasets.add, folder, digest.hexdigest(), declared.model_dump())
        try:
            dataset, new = await asyncio.get_running_loop().run_in_executor(service.aside, add)
        except BrdfError as error:
            error.field = error.field or "body"
            raise
    response.status_code = 201 if new else 200
    response.headers["location"] = f"/v1/datasets/{dataset.id}"
    return dataset


@router.get("/{dataset_id}", responses=responses(404, 406, 422))
async def read(request: Request, dataset_id: str) -> DatasetView:
    """What an uploaded file holds, and what of it was masked and why."""
    dataset = state(request).datasets.get(dataset_id)
    if dataset is None:
        raise ProblemError(404, f"Expected the id of an uploaded dataset, got {dataset_id!r}. Upload it again.")
    return dataset
