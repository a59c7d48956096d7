"""Where measured directions lie: wi and wo seen from above, and the half vector's angles.

Two discs show directions projected on the surface, the normal in the middle and the horizon at the rim, with circles
every 30 degrees; the third panel shows theta_d against theta_h. The colour of wo and of the third panel is the value, a
mean over channels on a logarithmic scale, so that the lobe shows where it is; the arrow on the discs is x.
Of more than 20,000 samples one in so many is drawn, which the title says.
"""

import math
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from ..formats.info import half_angles_deg
from ._figure import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..formats.samples import Samples

_MOST = 20_000
_PICTURE = 1000  # points that an SVG draws one by one; more become a picture in it
_CIRCLES = (30, 60, 90)  # polar angles [degrees]
_DECADES = 4  # of the colours' scale


def directions(samples: "Samples", *, title: str | None = None) -> "Figure":
    """The figure of where the directions of measured samples lie."""
    every = math.ceil(len(samples) / _MOST)
    drawn = samples.subset(torch.arange(0, len(samples), every)) if every > 1 else samples
    figure = new_figure(9.6, 3.7)
    figure.set_layout_engine("constrained", w_pad=0.08)
    wi, wo, plane = figure.subplots(1, 3)
    value = drawn.values.mean(-1)
    order = value.argsort()  # the brightest on top
    shown: dict[str, Any] = {"s": 9 if len(drawn) < _PICTURE else 4, "rasterized": len(drawn) > _PICTURE}
    _disc(wi, "light, wi")
    distinct = _distinct(drawn.wi)
    wi.scatter(
        distinct[:, 0],
        distinct[:, 1],
        color=COLOURS[1],
        clip_on=False,
        zorder=3,
        **{**shown, "s": 14 if len(distinct) < 300 else 2},
    )
    _disc(wo, "viewer, wo")
    floor = _floor(value)
    colours = {"c": value[order].clamp(min=floor), "norm": "log", "cmap": "viridis"}
    wo.scatter(drawn.wo[order, 0], drawn.wo[order, 1], clip_on=False, zorder=3, **colours, **shown)
    theta_h, theta_d = half_angles_deg(drawn)
    points = plane.scatter(theta_h[order], theta_d[order], clip_on=False, zorder=3, **colours, **shown)
    plane.set_xlim(0, 90)
    plane.set_ylim(0, 90)
    plane.set_aspect("equal")
    plane.set_xticks([0, 30, 60, 90])
    plane.set_yticks([0, 30, 60, 90])
    plane.grid(color="0.88", linewidth=0.6)
    plane.tick_params(labelsize=8)
    plane.set_title("half vector; θ_h = 0 is the mirror direction", fontsize=9)
    plane.set_xlabel("θ_h, half vector from the normal [°]", fontsize=8)
    plane.set_ylabel("θ_d, light from the half vector [°]", fontsize=8)
    bar = figure.colorbar(points, ax=plane, shrink=0.75, extend="min" if float(value.min()) < floor else "neither")
    bar.set_label("BRDF [1/sr], mean of the channels" if len(samples.channels) > 1 else "BRDF [1/sr]", fontsize=8)
    bar.ax.tick_params(which="both", labelsize=7)
    part = f", of which one in {every} is drawn" if every > 1 else ""
    observed = "observed" if samples.azimuth_observed else "not observed"
    name = title or samples.source or "measured samples"
    figure.suptitle(f"{name}: {len(samples):,} samples{part}; the sample's azimuth was {observed}", fontsize=10)
    return figure


def _disc(axes: Any, title: str) -> None:
    """Prepare axes for directions seen from above."""
    turn = torch.linspace(0, 2 * math.pi, 181)
    for theta in _CIRCLES:
        radius = math.sin(math.radians(theta))
        axes.plot(radius * turn.cos(), radius * turn.sin(), color="0.45" if theta == 90 else "0.85", linewidth=0.8)
        at = math.radians(112)
        axes.annotate(
            f"{theta}°",
            (radius * math.cos(at), radius * math.sin(at)),
            ha="center",
            va="center",
            fontsize=6.5,
            color="0.3",
            zorder=4,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8},
        )
    arrow = {"arrowstyle": "-|>", "color": "0.3", "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=(1.22, 0), xytext=(1.0, 0), arrowprops=arrow)
    axes.annotate("x", (1.25, 0), va="center", fontsize=8, annotation_clip=False)
    axes.set_xlim(-1.05, 1.32)
    axes.set_ylim(-1.08, 1.08)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(title, fontsize=9)


def _distinct(w: Tensor) -> Tensor:
    """The distinct directions, to about a hundredth of a degree."""
    rounded: Tensor = torch.round(w[:, :2] * 5000).unique(dim=0)
    return rounded / 5000


def _floor(value: Tensor) -> float:
    """The smallest value that the colours tell apart: four decades below the largest, or the smallest positive one."""
    positive = value[value > 0]
    if len(positive) == 0:
        return 1.0
    return max(float(positive.max()) * 10.0**-_DECADES, float(positive.min()))
