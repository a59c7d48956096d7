"""Images of scenes on the service, as the clients hand them out."""

from typing import Literal

from ..schemas import ProgressView, RenderOutcome, RenderView
from .calls import Call, content
from .errors import JobUnfinishedError
from .jobs import Awaited, Job, Waiting

Kind = Literal["png", "npy", "exr"]


class _Render(Job[RenderView]):
    """A render on the service."""

    _path, _name = "/v1/renders", "render"

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
        return (yield from content("GET", f"{self._path}/{self.id}/image.{kind}"))


class RenderResult(_Render, Waiting[RenderView, ProgressView]):
    """A render on the service."""

    def image(self, kind: Kind = "png") -> bytes:
        """The image as the bytes of a PNG file, or as linear radiance of a NumPy or OpenEXR file."""
        return self._run(self._drawn(kind))


class AsyncRenderResult(_Render, Awaited[RenderView, ProgressView]):
    """The same, to be awaited."""

    async def image(self, kind: Kind = "png") -> bytes:
        """The image as the bytes of a PNG file, or as linear radiance of a NumPy or OpenEXR file."""
        return await self._run(self._drawn(kind))
