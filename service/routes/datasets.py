"""POST /v1/datasets takes a measured file, GET /v1/datasets/{id} says what it holds, .../samples gives it."""

import asyncio
import hashlib
import json
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from brdfcore.energy._described import finite
from brdfcore.errors import BrdfError
from brdfcore.formats.samples import angles

from ..errors import WRITES, ProblemError, responses
from ..schemas import DatasetSamples, DatasetView
from ..state import State, state
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
    rgb: bool = Field(False, description="turns a spectrum into red, green and blue, which renderers take")


@router.post(
    "",
    status_code=201,
    responses={200: {"model": DatasetView, "description": "known"}, **responses(406, 408, 413, 415, 422, *WRITES)},
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
        said = declared.model_dump(exclude=None if declared.rgb else {"rgb"})  # so that ids stay what they were without
        arguments = folder, digest.hexdigest(), said, service.settings.upload_limit
        try:
            dataset, new = await asyncio.get_running_loop().run_in_executor(
                service.aside, service.datasets.add, *arguments
            )
        except BrdfError as error:
            error.field = error.field or "body"
            raise
    response.status_code = 201 if new else 200
    response.headers["location"] = f"/v1/datasets/{dataset.id}"
    return dataset


class Rows(BaseModel):
    """How many samples are wanted."""

    model_config = ConfigDict(extra="forbid")

    limit: int = Field(2000, ge=1, le=10_000, description="most rows; of more samples every n-th is given")


@router.get(
    "/{dataset_id}/samples",
    response_class=Response,
    responses={200: {"model": DatasetSamples}, **responses(404, 406, 422)},
)
async def samples(request: Request, dataset_id: str, asked: Annotated[Rows, Query()]) -> Response:
    """Give the samples of a dataset in degrees and 1/sr, or where they are too many, every n-th of them."""
    service = state(request)
    found(service, dataset_id)
    loop = asyncio.get_running_loop()
    rows = await loop.run_in_executor(service.aside, _rows, service, dataset_id, asked.limit)
    return Response(rows, media_type="application/json")


def _rows(service: State, dataset_id: str, limit: int) -> str:
    samples = service.datasets.read(dataset_id)
    stride = -(-len(samples) // limit)
    wi, wo, values = (part[::stride] for part in (samples.wi, samples.wo, samples.values))
    view = {"count": len(samples), "stride": stride, "channels": list(samples.channels)}
    for side, w in (("i", wi), ("o", wo)):
        theta, phi = (angle.rad2deg().tolist() for angle in angles(w))
        view |= {f"theta_{side}_deg": theta, f"phi_{side}_deg": phi}
    return json.dumps({**view, "values": finite(values)}, allow_nan=False)


@router.get("/{dataset_id}", responses=responses(404, 406, 422))
async def read(request: Request, dataset_id: str) -> DatasetView:
    """What an uploaded file holds, and what of it was masked and why."""
    return found(state(request), dataset_id)


def found(service: State, dataset_id: str) -> DatasetView:
    """The dataset of that id; 404 where there is none."""
    dataset = service.datasets.get(dataset_id)
    if dataset is None:
        raise ProblemError(404, f"Expected the id of an uploaded dataset, got {dataset_id!r}. Upload it again.")
    return dataset
