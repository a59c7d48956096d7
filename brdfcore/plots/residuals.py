"""What a fit leaves unexplained, by angle: residuals against theta_o, one panel an incidence, and against theta_h.

A residual is model minus measurement, as in the losses: above 0 the model is too bright. It is in units of the samples'
sigma where that is known, so that 95 % of pure noise lies in the shaded band of 2 sigma; else it is relative, (f - y) /
(y + d) with d = 1 % of the median positive y, as in the loss `relative` (either way the cosine cancels). theta_o is
positive on the mirror side of the normal, theta_h is the half vector's angle from the normal. Up to six angles of
incidence have a panel each, and a colour and a marker that they keep in the panel of theta_h; more of them share six
bands of as many samples each. A black line joins the medians of tenths of the samples, where there are enough: noise
scatters about 0, a wrong shape bends away from it. Of many samples 20,000 are drawn, of several channels one, the
brightest unless named. Residuals far beyond the others are drawn as triangles on the edge.
"""

import math
import textwrap
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

from ..fitting.incidences import incidences
from ..fitting.losses import Scales
from ._figure import COLOURS, new_figure
from .lobes import drawn_channel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..fitting.result import Fit
    from ..formats.samples import Samples
    from ..models.material import Material

_MOST = 20_000  # samples that are drawn
_MANY = 1000  # points that an SVG draws one by one; more become a picture in it
_MEDIANS = 10  # on a line, each of at least as many samples
_FAR = 3.0  # times the 95th percentile: what is beyond does not set the scale
_MARKERS = "osD^vP"


def residuals(fit: "Fit", *, channel: str | int | None = None) -> "Figure":
    """The figure of a fit's residuals, model minus measurement, by angle, in units of sigma or relative [1].

    Raises UnknownNameError for a channel that does not exist.
    """
    return residuals_of(fit.material, fit.samples, channel=channel)


def residuals_of(material: "Material", samples: "Samples", *, channel: str | int | None = None) -> "Figure":
    """The same for any material and samples."""
    index, name = drawn_channel(material, samples, channel)
    whole = len(samples)
    scale = Scales.of(samples.values[:, index : index + 1], samples.wi[:, 2:]).y  # of all samples
    if whole > _MOST:
        chosen = torch.randperm(whole, generator=torch.Generator().manual_seed(0))[:_MOST]
        samples = samples.subset(chosen.sort().values)
    with torch.no_grad():
        f = material.f(samples.wi, samples.wo)
    left = f[:, min(index, f.shape[1] - 1)] - samples.values[:, index]
    if samples.sigma is not None:
        residual = left / samples.sigma[:, index]
    else:
        residual = left / (samples.values[:, index].clamp(min=0) + 0.01 * scale)
    notes = [f"channel {name}" * bool(name), f"{_MOST:,} of {whole:,} samples drawn" * (whole > _MOST)]
    return _draw(samples, residual, material.form.text(), [note for note in notes if note])


def _signed_theta_o(samples: "Samples") -> Tensor:
    """theta_o [deg], positive where wo leans away from wi, (N,)."""
    theta = torch.rad2deg(torch.atan2(torch.hypot(samples.wo[:, 0], samples.wo[:, 1]), samples.wo[:, 2]))
    return torch.where((samples.wi[:, :2] * samples.wo[:, :2]).sum(-1) > 0, -theta, theta)


def _medians(x: Tensor, y: Tensor) -> tuple[list[float], list[float]]:
    """Medians of y over tenths of the samples in the order of x; none where there are too few."""
    if len(x) < _MEDIANS**2:
        return [], []
    parts = x.argsort().tensor_split(_MEDIANS)
    return [float(x[part].median()) for part in parts], [float(y[part].median()) for part in parts]


def _draw(samples: "Samples", residual: Tensor, title: str, notes: list[str]) -> "Figure":
    half = samples.wi + samples.wo
    theta_h = torch.rad2deg(torch.atan2(torch.hypot(half[:, 0], half[:, 1]), half[:, 2]))
    theta_o = _signed_theta_o(samples)
    groups = [(group.title, group.chosen) for group in incidences(samples)]
    columns = {1: 1, 2: 2, 4: 2}.get(len(groups), 3)
    rows = math.ceil(len(groups) / columns)
    names = [
        [f"panel {r * columns + c}" if r * columns + c < len(groups) else "." for c in range(columns)]
        for r in range(rows)
    ]
    width = max(2.7 * columns, 5.4)
    wrapped = textwrap.wrap(title, int(12.5 * width)) + [", ".join(notes)] * bool(notes)
    figure = new_figure(width, 1.75 * rows + 2.7 + 0.2 * len(wrapped) + 0.2 * (len(groups) > 2))
    figure.set_layout_engine("constrained", h_pad=0.05, w_pad=0.05)
    figure.suptitle("\n".join(wrapped), fontsize=10)
    heights = [1.0] * rows + [1.25]
    axes = figure.subplot_mosaic([*names, ["theta_h"] * columns], height_ratios=heights)  # type: ignore[list-item]
    reach = _reach(residual, known=samples.sigma is not None)
    for number, (label, chosen) in enumerate(groups):
        own, style = axes[f"panel {number}"], {"color": COLOURS[number], "marker": _MARKERS[number]}
        _points(own, theta_o[chosen], residual[chosen], reach, style)
        _points(axes["theta_h"], theta_h[chosen], residual[chosen], reach, style)
        own.set_title(label, fontsize=8.5)
        own.set_xlim(-90, 90)
        own.set_xticks([-60, -30, 0, 30, 60])
        own.set_xlabel(r"$\theta_o$ [°]" if number + columns >= len(groups) else "", fontsize=8.5)
        own.tick_params(labelbottom=number + columns >= len(groups), labelleft=number % columns == 0)
        own.plot(*_medians(theta_o[chosen], residual[chosen]), color="black", linewidth=1.2)
    below = axes["theta_h"]
    line = _medians(theta_h, residual)
    below.plot(*line, color="black", linewidth=1.2)
    widest = max(5.0, float(theta_h.max()))
    below.set_xlim(-0.01 * widest, 1.03 * widest)
    below.set_xlabel(r"$\theta_h$ [°]", fontsize=8.5)
    for place in axes.values():
        place.set_ylim(-reach, reach)
        place.axhline(0, color="0.3", linewidth=0.9, zorder=1)
        if samples.sigma is not None:
            place.axhspan(-2, 2, color="0.92", zorder=0)
        place.tick_params(labelsize=7.5)
        place.grid(color="0.88", linewidth=0.5, zorder=0)
        place.set_axisbelow(True)
    unit = " sigma" if samples.sigma is not None else "\n(measurement + 1 % of its median)"
    figure.supylabel(f"(model - measurement) /{unit} [1]", fontsize=9)
    labels = [label for label, _ in groups]
    handles = _handles(
        labels, median=bool(line[0]), band=samples.sigma is not None, beyond=bool((residual.abs() > reach).any())
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    return figure


def _handles(labels: list[str], *, median: bool, band: bool, beyond: bool) -> list[Any]:
    """What the legend shows: the incidences as they are drawn, only larger, and what else there is."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    found: list[Any] = [
        Line2D([], [], linestyle="", marker=marker, color=colour, markersize=5, markeredgewidth=0, label=label)
        for label, colour, marker in zip(labels, COLOURS, _MARKERS, strict=False)
    ]
    if median:
        found.append(Line2D([], [], color="black", linewidth=1.2, label="median"))
    if band:
        found.append(Patch(color="0.92", label="2 sigma"))
    if beyond:
        found.append(Line2D([], [], linestyle="", marker="v", color="0.5", markersize=5, label="beyond the axis"))
    return found


def _reach(residual: Tensor, *, known: bool) -> float:
    """The end of the axis of residuals: the largest, or where few are far beyond the others, that of the others."""
    size = residual.abs()
    usual = _FAR * float(torch.quantile(size, 0.95))
    largest = float(size.max())
    return max(1.08 * (min(largest, usual) if usual > 0 else largest), 3.0 if known else 1e-12)


def _points(place: Any, x: Tensor, y: Tensor, reach: float, style: dict[str, Any]) -> None:
    """Draw residuals, those beyond the axis as triangles on its edge."""
    inside = y.abs() <= reach
    many = len(x) > _MANY
    common = {"linestyle": "", "rasterized": many, "alpha": 0.3 if many else 0.8, "zorder": 2}
    place.plot(x[inside], y[inside], markersize=1.5 if many else 4, markeredgewidth=0, **common, **style)
    for sign, marker in ((1, "^"), (-1, "v")):
        beyond = ~inside & (sign * y > 0)
        if bool(beyond.any()):
            edge = torch.full_like(x[beyond], 0.97 * sign * reach)
            place.plot(x[beyond], edge, **{**common, "color": style["color"], "marker": marker, "markersize": 5})
