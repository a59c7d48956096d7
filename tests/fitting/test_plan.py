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
    "no text": ({"model": None}, ModelTextError, "model", "got NoneType"),
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
