"""What a fit is asked to do, and what is refused before any work."""

import pytest

from brdfcore.errors import BrdfError, ModelTextError, ParameterError, UnknownNameError
from brdfcore.fitting import check
from brdfcore.fitting.plan import plan


def test_open_options_are_decided_by_the_data() -> None:
    assert plan(1, "lambert + ward", azimuth_observed=True).form.text() == "lambert + ward(anisotropic)"
    seen = plan(1, "lambert + ward", azimuth_observed=False)
    assert seen.form.text() == "lambert + ward(isotropic)"
    assert seen.choices == ("ward is isotropic: the sample's azimuth was not observed.",)


def test_words_and_names_insist() -> None:
    made = plan(1, "ward(anisotropic) + kurt(m=0.2)", azimuth_observed=False)
    assert made.form.text() == "ward(anisotropic) + kurt(isotropic, schlick)"
    assert made.choices == ()


def test_reflectances_widen_to_the_channels() -> None:
    made = plan(31, "lambert + kurt", gray=("kurt.ks",))
    assert {key: tuple(value.shape) for key, value in made.start.items()} == {
        "lambert.kd": (31,),
        "kurt.ks": (),
        "kurt.f0": (),
        "kurt.m": (),
        "kurt.alpha": (),
    }
    assert plan(31, "lambert + kurt", per_channel=("kurt.f0",)).start["kurt.f0"].shape == (31,)
    assert plan(2, "lambert + kurt(f0=[0.1, 0.2])").start["kurt.f0"].tolist() == [0.1, 0.2]
    assert plan(3, "ashikhmin_shirley").start["ashikhmin_shirley.f0"].shape == (3,)


def test_the_check_knows_what_the_data_decide() -> None:
    check(1, "ward", fixed={"ward.ax": 0.1}, azimuth_observed=True)
    with pytest.raises(UnknownNameError, match=r"Did you mean 'ward\.a'"):
        check(1, "ward", fixed={"ward.ax": 0.1})


def test_bounds_narrow_the_box_and_what_starts_are_drawn_from() -> None:
    made = plan(1, "lambert + kurt", bounds={"kurt.m": (0.01, 0.2), "kurt.alpha": (0.6, 0.8)})
    assert [float(end) for end in made.limits("kurt.m")] == [0.01, 0.2]
    assert made.search_range("kurt.m") == (0.01, 0.2)
    assert made.search_range("kurt.alpha") == (0.6, 0.8)  # outside the usual search
    assert made.search_range("kurt.f0") == (0, 1)


def test_starts_are_the_texts_and_the_users() -> None:
    assert plan(1, "lambert + kurt").starts == ()
    made = plan(1, "lambert + kurt(m=0.3)", starts=[{"kurt.alpha": 0.4}, {"kurt.m": 0.01}])
    assert [float(start["kurt.m"]) for start in made.starts] == [0.3, 0.3, 0.01]
    assert float(made.starts[1]["kurt.alpha"]) == 0.4


def test_fixed_values_are_not_free() -> None:
    made = plan(1, "lambert + kurt", fixed={"kurt.f0": 0.5})
    assert "kurt.f0" not in made.free
    assert float(made.start["kurt.f0"]) == 0.5


REFUSED = {
    "unknown loss": ({"loss": "cosin"}, UnknownNameError, "loss", "Did you mean 'cosine'"),
    "unknown optimizer": ({"optimizer": "adm"}, UnknownNameError, "optimizer", "Did you mean 'adam'"),
    "unknown model": ({"model": "lambert + krut"}, UnknownNameError, "model", "Did you mean 'kurt'"),
    "fixed key": ({"fixed": {"kurt.f1": 1}}, UnknownNameError, "fixed", "Did you mean 'kurt.f0'"),
    "gray key": ({"gray": ["ks"]}, UnknownNameError, "gray", "kurt.ks"),
    "per_channel key": ({"per_channel": ["kurt.x"]}, UnknownNameError, "per_channel", "kurt.f0"),
    "per_channel shape": ({"per_channel": ["kurt.m"]}, ParameterError, "per_channel", "one value for all channels"),
    "out of box": ({"model": "lambert + kurt(f0=1.5)"}, ParameterError, "kurt.f0", "[0, 1], got 1.5"),
    "fixed out of box": ({"fixed": {"kurt.m": 50}}, ParameterError, "kurt.m", "[0.0001, 10], got 50"),
    "channels": ({"model": "lambert(kd=[0.1, 0.2]) + kurt"}, ParameterError, "lambert.kd", "3 channels"),
    "total's channels": (
        {"model": "lambert(kd=[0.1, 0.2] - kurt.ks) + kurt"},
        ParameterError,
        "lambert.kd",
        "3 channels as the data has, got 2",
    ),
    "gray list": (
        {"model": "lambert(kd=[0.1, 0.2, 0.1]) + kurt", "gray": ["lambert.kd"]},
        ParameterError,
        "lambert.kd",
        "one number, since gray names it",
    ),
    "gray and per channel": (
        {"gray": ["kurt.f0"], "per_channel": ["kurt.f0"]},
        ParameterError,
        "per_channel",
        "got it in both",
    ),
    "gray as a text": ({"gray": "lambert.kd"}, ParameterError, "gray", "Write ['lambert.kd']"),
    "fixed text": ({"fixed": {"kurt.f0": "a"}}, ParameterError, "kurt.f0", "to be a number"),
    "fixed truth": ({"fixed": {"kurt.f0": True}}, ParameterError, "kurt.f0", "to be a number"),
    "no text": ({"model": None}, ModelTextError, "model", "got None"),
    "seed": ({"seed": -1}, ParameterError, "seed", "got -1"),
    "large seed": ({"seed": 10**23}, ParameterError, "seed", "2^63"),
    "total too large": ({"model": "lambert(kd=3 - kurt.ks) + kurt"}, ParameterError, "lambert.kd", "Change the total"),
    "fixed beyond its tie": (
        {"model": "lambert(kd=0.175 - kurt.ks) + kurt", "fixed": {"kurt.ks": 0.5}},
        ParameterError,
        "kurt.ks",
        "fixed within [0, 0.175]",
    ),
    "tie of a wrong shape": ({"model": "kurt(m=lambert.kd) + lambert"}, ParameterError, "kurt.m", "one number"),
    "bounds key": ({"bounds": {"kurt.mm": (0.1, 1)}}, UnknownNameError, "bounds", "Did you mean 'kurt.m'"),
    "bounds no mapping": ({"bounds": [("kurt.m", 0.1, 1)]}, ParameterError, "bounds", "got list"),
    "bounds reversed": ({"bounds": {"kurt.m": (1, 0.1)}}, ParameterError, "bounds", "the lower one first"),
    "bounds beyond the box": ({"bounds": {"kurt.f0": (0.1, 2)}}, ParameterError, "bounds", "lie in [0, 1]"),
    "bounds against a start": (
        {"model": "lambert + kurt(m=0.5)", "bounds": {"kurt.m": (0.01, 0.2)}},
        ParameterError,
        "kurt.m",
        "within its bounds (0.01, 0.2), got 0.5",
    ),
    "bounds against a fixed value": (
        {"fixed": {"kurt.m": 0.5}, "bounds": {"kurt.m": (0.01, 0.2)}},
        ParameterError,
        "kurt.m",
        "got 0.5",
    ),
    "bounds against a tie": (
        {"model": "lambert(kd=0.175 - kurt.ks) + kurt", "bounds": {"kurt.ks": (0.2, 0.4)}},
        ParameterError,
        "bounds",
        "those leave [0, 0.175]",
    ),
    "starts key": ({"starts": [{"kurt.mm": 0.1}]}, UnknownNameError, "starts", "Did you mean 'kurt.m'"),
    "starts no list": ({"starts": {"kurt.m": 0.1}}, ParameterError, "starts", "got str in it"),
    "start beyond the box": ({"starts": [{"kurt.m": 100}]}, ParameterError, "kurt.m", "[0.0001, 10], got 100"),
    "robust form": ({"robust": "cauch"}, UnknownNameError, "robust", "Did you mean 'cauchy'"),
    "robust scale alone": ({"robust_scale": 0.1}, ParameterError, "robust_scale", "Name one of soft_l1, cauchy"),
    "robust scale": ({"robust": "cauchy", "robust_scale": 0}, ParameterError, "robust_scale", "positive number, got 0"),
    "angle in degrees": ({"max_theta": 80}, ParameterError, "max_theta", "math.radians(80)"),
    "contradiction": ({"model": "kurt(isotropic, mx=0.2)"}, ModelTextError, "model", "Drop one of them"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals_are_one_sentence_that_names_the_field(case: str) -> None:
    keywords, kind, field, part = REFUSED[case]
    with pytest.raises(kind) as caught:
        check(3, **{"model": "lambert + kurt", **keywords})
    assert isinstance(caught.value, BrdfError)
    assert caught.value.field == field
    assert part in str(caught.value)
    assert str(caught.value).startswith("Expected ")
