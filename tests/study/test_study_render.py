"""The study of images: its table is what its images are."""

import math

import pytest

from brdfcore.study import STUDIES
from brdfcore.study.render import FLOORS, WAYS, _sentence
from brdfcore.study.report import to_dict, write


@pytest.fixture(scope="module")
def study():
    return STUDIES["render"](quick=True, size=5, counts=(8, 64), models=("lambert", "ward_bounded"))


def test_noise_falls_with_the_samples(study) -> None:
    assert [panel.title for panel in study.charts[0].panels] == list(FLOORS)
    for panel in study.charts[0].panels:
        assert [curve.label for curve in panel.curves] == list(WAYS)
        both = panel.curves[-1]
        assert both.y[1] < 0.8 * both.y[0]
    by_light, by_material, _ = study.charts[0].panels[0].curves
    assert by_material.y[1] < by_light.y[1], "of a narrow lobe, its own samples are worth more"


def test_effects_and_models_have_their_rows(study) -> None:
    rows = {(case, what, count): numbers for case, what, count, *numbers in study.rows}
    error = {what: numbers[1] for (case, what, _), numbers in rows.items() if case == "corner"}
    assert error["without floor: lambert"] > 3 * error["everything"]
    assert error["without interreflection 1"] > error["without interreflection 2"]
    even, skewed = rows["lambert", "its own samples", 64], rows["ward_bounded", "its own samples", 64]
    assert even[1] < 1e-6 < skewed[1] < 0.5
    assert even[2] is None or even[2] > 100
    assert skewed[2] == pytest.approx(20 * math.log10(1 / skewed[1]), abs=15)


def test_the_papers_images_are_what_the_papers_say(study) -> None:
    """Uniform weights are off at grazing angles, right ones only noisy; Kurt's model is nearer than Ward-Duer's."""
    error = {(case, what): numbers[1] for case, what, _, *numbers in study.rows}
    assert error["G-M&D Fig. 2", "samples, uniform weights"] > 2 * error["G-M&D Fig. 2", "direct"]
    assert error["fitted table", "the metal itself"] < error["fitted table", "Kurt"]
    names = [what for case, what, *_ in study.rows if case == "fitted table"]
    assert names == sorted(names, key=lambda name: error["fitted table", name])
    assert [picture.name for picture in study.pictures] == [
        "render-2-luminance",
        "render-8-luminance",
        "render-fitted",
        "render-samples",
    ]


def test_pictures_are_written(study, tmp_path) -> None:
    names = {path.name for path in write(study, tmp_path)}
    assert {f"{picture.name}.svg" for picture in study.pictures} < names
    assert "Kurt Fig. 9" in (tmp_path / "render-fitted.svg").read_text()
    assert to_dict(study)["pictures"][0] == {"name": "render-2-luminance", "title": study.pictures[0].title}


def test_variances_are_of_a_sample(study) -> None:
    """Whatever their number, and the errors are theirs."""
    (few, many), *_ = ([n for c, what, *n in study.rows if (c, what) == ("a narrow lobe", way)] for way in WAYS)
    assert few[0] < many[0]
    assert many[2] == pytest.approx(math.sqrt(many[-1] / many[0]), rel=0.5)
    assert few[-1] == pytest.approx(many[-1], rel=0.5)


def test_the_sentence_is_computed() -> None:
    wins = [
        ("a", {"samples of the light": 4.0, "both, by the power heuristic": 2.0}),
        ("b", dict.fromkeys(WAYS, 3.0)),
    ]
    text = _sentence(wins, {"rain": (0.1, 0.02), "snow": (0.1, 0.5)})
    assert "never took more than 1 times" in text
    assert "the worse way up to 2 times as long as both" in text
    assert "leaving out snow costs most, 50 % of the mean." in text
