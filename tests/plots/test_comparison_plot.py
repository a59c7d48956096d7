"""The plot of a comparison shows what it says, legibly."""

import dataclasses

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import brdfcore as bc
from brdfcore.demo import DATA
from brdfcore.errors import UnknownNameError

MODELS = ["lambert", "lambert + ward_bounded", "ward", "kurt"]


@pytest.fixture(scope="module")
def compared() -> bc.Comparison:
    return bc.compare(bc.read(DATA), MODELS)


def test_dots_stand_at_the_errors(compared: bc.Comparison) -> None:
    figure = bc.plots.comparison(compared)
    assert len(figure.axes) == len(bc.LOSSES)
    for axes, loss in zip(figure.axes, bc.LOSSES, strict=True):
        assert axes.get_xscale() == "log"
        dots = [line for line in axes.get_lines() if line.get_marker() == "o"]
        assert [float(dot.get_xdata()[0]) for dot in dots] == list(compared.errors(loss).values())
        assert [float(dot.get_ydata()[0]) for dot in dots] == [0, 1, 2, 3]
        filled = [dot.get_markerfacecolor() != "white" for dot in dots]
        assert filled.index(True) == min(range(4), key=list(compared.errors(loss).values()).__getitem__)
    first = figure.axes[0]
    assert [label.get_text() for label in first.get_yticklabels()] == list(compared.models)
    assert first.get_ylim()[0] > first.get_ylim()[1], "the best is on top"


def test_the_factor_to_the_best_is_written_at_each_dot(compared: bc.Comparison) -> None:
    (axes,) = bc.plots.comparison(compared, ["l2"]).axes
    errors = list(compared.errors("l2").values())
    written = [text.get_text() for text in axes.texts]
    for error, text in zip(errors, written, strict=True):
        factor = error / min(errors)
        assert text == (
            f"{error:.3g}" if factor == 1 else f"\u00d7{factor:.3g}" if factor < 1000 else f"\u00d7{factor:.0f}"
        )


@pytest.mark.parametrize("losses", [None, ["l2", "log"]])
def test_texts_do_not_overlap_and_stay_inside(compared: bc.Comparison, losses: list[str] | None) -> None:
    long = "lambert(kd=0.175 - ward_bounded.rs) + ward_bounded(isotropic) + ward_bounded(isotropic)"
    figure = bc.plots.comparison(dataclasses.replace(compared, models=(long, *compared.models[1:])), losses)
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    width, height = figure.canvas.get_width_height()
    texts = [*figure.texts]
    for axes in figure.axes:
        texts += [axes.title, *axes.texts]
    texts += figure.axes[0].get_yticklabels()
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts if text.get_text()]
    for i, (text, box) in enumerate(boxes):
        assert box.x0 >= -1, text
        assert box.x1 <= width + 1, text
        assert box.y0 >= -1, text
        assert box.y1 <= height + 1, text
        assert [other for other, place in boxes[:i] if box.overlaps(place)] == [], text


def test_an_error_of_zero_and_an_unknown_loss(compared: bc.Comparison) -> None:
    exact = dataclasses.replace(compared.fits[0])
    vars(exact)["errors"] = dict.fromkeys(compared.fits[0].errors, 0.0)
    figure = bc.plots.comparison(dataclasses.replace(compared, fits=(exact, *compared.fits[1:])), ["l2"])
    dot = next(line for line in figure.axes[0].get_lines() if line.get_marker() == "o")
    assert float(dot.get_xdata()[0]) == figure.axes[0].get_xlim()[0]
    with pytest.raises(UnknownNameError, match="Did you mean 'cosine'"):
        bc.plots.comparison(compared, ["cosin"])
