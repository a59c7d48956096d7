"""The plot of accuracy against time shows what it says, legibly."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from brdfcore.plots._panels import Curve, Panel, styles
from brdfcore.plots.accuracy import accuracy
from brdfcore.plots.curves import curves


def panel(title: str, number: int = 4, points: int = 3) -> Panel:
    made = tuple(
        Curve(
            f"a method of number {k}",
            tuple(10.0 ** (i - k) for i in range(points)),
            tuple(10.0**-i for i in range(points)),
        )
        for k in range(number)
    )
    return Panel(title, made, (("what is asked", 1e-2),))


def test_points_that_a_log_axis_cannot_show_are_left_out() -> None:
    curve = Curve("method", (1.0, 2.0, 3.0, 4.0), (1e-2, 0.0, float("nan"), 1e-3))
    (axes,) = accuracy([Panel("case", (curve,))], "title").axes
    assert axes.get_xscale() == axes.get_yscale() == "log"
    line = axes.get_lines()[0]
    np.testing.assert_array_equal(line.get_xdata(), [1.0, 4.0])
    np.testing.assert_array_equal(line.get_ydata(), [1e-2, 1e-3])


def test_panels_share_their_axes_and_the_level_is_drawn() -> None:
    figure = accuracy([panel("one", 1), panel("two", 3)], "title", "time [ns]", "error [1]")
    first, second = figure.axes
    assert first.get_xlim() == second.get_xlim()
    assert first.get_ylim() == second.get_ylim()
    assert first.get_xlabel() == "time [ns]"
    assert figure.get_supylabel() == "error [1]"
    assert list(first.get_lines()[-1].get_ydata()) == [1e-2, 1e-2]


def test_a_label_has_one_style_and_no_two_look_alike() -> None:
    pair = (Curve("f64", (1.0,), (1.0,), "method"), Curve("f32", (1.0,), (1.0,), "method", hollow=True))
    found = styles([Panel("", (*pair, *panel("", 20).curves))])
    assert found["f64"]["color"] == found["f32"]["color"]
    assert found["f32"]["markerfacecolor"] == "white"
    assert found["f64"]["linestyle"] == "", "one point is no line"
    looks = {(s["color"], s["marker"], s["markerfacecolor"], s["linestyle"]) for s in found.values()}
    assert len(looks) == 22


@pytest.mark.parametrize("count", [1, 10])
def test_texts_do_not_overlap_and_stay_inside(count: int) -> None:
    title = "A title of some length that has to be wrapped where the figure is narrow, as it is here and there"
    figure = accuracy([panel(f"panel {k}", 9) for k in range(count)], title)
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    texts = [*figure.texts, *figure.legends[0].get_texts(), *(axes.title for axes in figure.axes)]
    for axes in figure.axes:
        texts.append(axes.xaxis.label)
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            texts += [tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    shown = [text for text in texts if text.get_visible() and text.get_text()]
    assert all(axes.get_window_extent(renderer).height > figure.dpi for axes in figure.axes), "an inch is left to see"
    width, height = figure.canvas.get_width_height()
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in shown]
    for i, (text, box) in enumerate(boxes):
        assert box.x0 >= -1, text
        assert box.x1 <= width + 1, text
        assert box.y0 >= -1, text
        assert box.y1 <= height + 1, text
        assert [other for other, place in boxes[:i] if box.overlaps(place)] == [], text


def test_plain_axes_end_where_the_panel_says() -> None:
    made = Panel("case", (Curve("y", (0.0, 1.0, 2.0), (1.0, 2.0, 8.0), marked=False),), (("1", 1.0),), (0, 2, 0, 4))
    (axes,) = curves([made], "title", "x [1]", "y [1]", equal=True).axes
    assert axes.get_xlim() == (0, 2)
    assert axes.get_ylim() == (0, 4)
    assert axes.get_aspect() == 1
    np.testing.assert_array_equal(axes.get_lines()[0].get_ydata(), [1.0, 2.0, 8.0])
    assert axes.get_lines()[0].get_marker() in ("", "None", None)
