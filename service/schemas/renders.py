"""Images of scenes: what is asked for, and the job that makes one."""

from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag

from ._base import Body, View
from .jobs import JobView

SceneName = Annotated[str, Field(min_length=1, max_length=200), Tag("<text>")]
SceneIn = Annotated[
    SceneName | Annotated[dict[str, Any], Tag("<json>")],
    Discriminator(lambda value: "<json>" if isinstance(value, dict) else "<text>"),
]


class RenderRequest(Body):
    """A scene, and how well its image is to be known."""

    scene: SceneIn = Field(description="a scene's JSON (camera, objects, lights), or the name of a shipped one")
    tolerance: float = Field(1e-3, ge=0, le=1e6, description="radiance that the plan may leave out")
    samples: int | None = Field(None, ge=1, le=2**20, description="a pixel's, at most; the scene's, if absent")
    noise: float | None = Field(
        None, gt=0, description="root mean square of the pixels' standard errors at which sampling stops [radiance]"
    )
    seed: int = Field(0, ge=0, lt=2**63)


class RenderRequestView(View):
    """A render's request as it was accepted."""

    scene: str | dict[str, Any]
    tolerance: float
    samples: int
    noise: float | None
    seed: int


class EffectView(View):
    """A row of the plan: an effect that is simulated, or is not."""

    name: str
    on: bool
    reason: str
    cost: float = Field(description="term evaluations and ray tests that it adds, or would add, predicted")
    error: float | None = Field(
        description="bound on what leaving it out changes in a pixel [radiance]; null where nothing bounds it"
    )
    forced: bool
    partial: bool = Field(
        False, description="whether error is a part of the bound only, which was too much already to leave it out"
    )
    estimated: bool = Field(
        False, description="whether error is no bound: that of a mean radiance, or of a table's sampled albedo"
    )


class PlanView(View):
    """What was simulated, and why, exactly as `Plan.to_dict()` gives it."""

    effects: list[EffectView]
    tolerance: float
    error: float | None = Field(description="bound on what is left out [radiance]; null where nothing bounds it")
    met: bool = Field(description="whether error is at most tolerance")
    cost: float = Field(description="term evaluations and ray tests of the image, predicted")


class RenderOutcome(View):
    """A finished render, without its image: GET /v1/renders/{render_id}/image.png, .npy or .exr sends that."""

    hash: str = Field(description="of what made it: version, scene, tolerance and seed")
    version: str
    seed: int
    width: int
    height: int
    plan: PlanView
    table: str = Field(description="the plan as plain text, for people")
    samples: int = Field(description="a ray, that were taken; 0 where nothing is random")
    noise: float = Field(description="root mean square of the pixels' standard errors [radiance]")
    seconds: float


class RenderSummary(JobView):
    """A render's job without its result, as the list shows it."""

    request: RenderRequestView


class RenderView(RenderSummary):
    """A render's job and, once it has succeeded, what came out."""

    result: RenderOutcome | None


class RenderPage(View):
    """Renders, newest first; `next` is the cursor of the page that follows."""

    items: list[RenderSummary]
    next: str | None
