"""Renders on the service, as the clients hand them out, to wait for or to await."""

import time
from collections.abc import Mapping
from typing import Any, Literal

from . import client_calls as calls
from .client_calls import Call, Tell
from .client_errors import JobFailedError, JobUnfinishedError
from .client_results import _Awaited, _Job, _Waiting
from .schemas import RenderOutcome, RenderView

Scene = Any  # the name of a shipped one, its JSON, or an object like brdfcore.render.Scene
Kind = Literal["png", "npy"]
_PATH, _NAME = "/v1/renders", "render"


class _Render(_Job[RenderView]):
    """A render on the service."""

    _path, _name = _PATH, _NAME

    def __repr__(self) -> str:
        scene = self.view.request.scene
        shown = scene if isinstance(scene, str) else f"{len(scene.get('objects', ()))} objects"
        return f"{type(self).__name__}({self.id}, {shown!r}, {self.job_status})"

    @property
    def result(self) -> RenderOutcome:
        """What was simulated and why, the noise that was reached, and what it cost."""
        if self.view.result is None:
            raise JobUnfinishedError(self._unfinished())
        return self.view.result

    def _drawn(self, kind: Kind) -> Call[bytes]:
        return (yield from calls.content("GET", f"{_PATH}/{self.id}/image.{kind}"))


class RenderResult(_Render, _Waiting[RenderView]):
    """A render on the service."""

    def image(self, kind: Kind = "png") -> bytes:
        """The image as the bytes of a PNG file, or of a NumPy file of linear radiance."""
        content: bytes = self._run(self._drawn(kind))
        return content


class AsyncRenderResult(_Render, _Awaited[RenderView]):
    """The same, to be awaited."""

    async def image(self, kind: Kind = "png") -> bytes:
        """The image as the bytes of a PNG file, or of a NumPy file of linear radiance."""
        content: bytes = await self._run(self._drawn(kind))
        return content


def rendered(
    scene: Scene, asked: Mapping[str, Any], wait: bool, timeout: float | None, progress: Tell | None
) -> Call[RenderView]:
    """The render of a scene; `asked` holds the other fields of POST /v1/renders, None for what the scene says."""
    begun = time.monotonic()
    given = {name: value for name, value in asked.items() if value is not None}
    body = {"scene": calls.material_of(scene), **given}
    view = yield from calls.submitted(_PATH, body, RenderView, wait and progress is None, timeout)
    if not wait:
        return view
    left = None if timeout is None else max(0.0, timeout - (time.monotonic() - begun))
    return (yield from calls.finished(_PATH, view, _NAME, JobFailedError, left, progress))
