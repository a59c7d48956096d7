"""Several models at the same samples."""

import json

import pytest
from fit_cases import TRUE, measured_from

import brdfcore as bc
from brdfcore.errors import BrdfError, ModelTextError, UnknownNameError
from brdfcore.fitting.comparison import LOBES

MODELS = ["lambert", "lambert + kurt(isotropic)", "lambert + ward_bounded(isotropic)"]


@pytest.fixture(scope="module")
def compared() -> bc.Comparison:
    return bc.compare(measured_from(TRUE, noise=0.01), MODELS)


def test_models_are_ranked_by_what_was_minimised(compared: bc.Comparison) -> None:
    objectives = [fit.objective for fit in compared.fits]
    assert objectives == sorted(objectives)
    assert compared.models == (MODELS[2], MODELS[1], MODELS[0])
    assert compared.best is compared.fits[0]
    assert [fit.model for fit in compared.fits] == [
        "lambert + ward_bounded(isotropic)",
        *[bc.material(text).form.text() for text in (MODELS[1], MODELS[0])],
    ]
    alone = bc.fit(compared.best.samples, MODELS[1])
    assert compared.errors("log")[MODELS[1]] == alone.errors["log"]
    assert list(compared.errors("cosine").values()) == objectives
    by_log = bc.compare(compared.best.samples, MODELS, "log")
    assert by_log.errors("log")[MODELS[1]] < compared.errors("log")[MODELS[1]]


def test_the_report_has_every_model_under_every_loss(compared: bc.Comparison) -> None:
    header, *lines = compared.report().splitlines()
    assert header.split() == ["model", "cosine*", *list(bc.LOSSES)[1:], "values", "seconds", "status"]
    for rank, (model, fit, line) in enumerate(zip(compared.models, compared.fits, lines, strict=False), start=1):
        assert line.startswith(f"{rank} ")
        assert model in line
        assert all(f"{fit.errors[name]:.5g}" in line for name in bc.LOSSES)
        assert line.endswith(fit.status)
    assert lines[0].split()[-3] == "7"
    assert compared.report(["log"]).splitlines()[0].split() == ["model", "log", "values", "seconds", "status"]


def test_what_is_undetermined_is_told() -> None:
    compared = bc.compare(measured_from("lambert(kd=0.2)", count=60), ["lambert + ward_bounded(isotropic)"])
    assert "not determined by the data: ward_bounded.a" in compared.report()
    assert compared.to_dict()["ranking"][0]["undetermined"] == ["ward_bounded.a"]


def test_the_result_is_json(compared: bc.Comparison) -> None:
    result = json.loads(json.dumps(compared.to_dict(), allow_nan=False))
    assert [row["rank"] for row in result["ranking"]] == [1, 2, 3]
    assert result["ranking"][0]["fit"]["parameters"].keys() == compared.best.parameters.keys()
    assert result["ranking"][2]["parameters"] == 3
    assert result["report"] == compared.report()
    assert result["loss"] == "cosine"


def test_known_sigma_ranks_by_chi_square() -> None:
    compared = bc.compare(measured_from(TRUE, noise=0.01, sigma=True), MODELS)
    assert "minimised*" in compared.report().splitlines()[0]
    assert "cosine*" not in compared.report()
    assert f"{compared.best.objective:.5g}" in compared.report()


def test_keywords_concern_the_models_that_have_them_and_progress_rises() -> None:
    seen: list[bc.Progress] = []
    samples = measured_from(TRUE, noise=0.01)
    fixed = {"kurt.alpha": 0.0, "ward_bounded.a": 0.12}
    compared = bc.compare(samples, [*MODELS, MODELS[0]], fixed=fixed, gray=["lambert.kd"], progress=seen.append)
    assert [fit.fixed for fit in compared.fits] == [("ward_bounded.a",), ("kurt.alpha",), ()]
    fractions = [p.fraction for p in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1)


def test_every_lobe_of_the_registry_is_compared_by_default() -> None:
    diffuse = {"lambert", "coupled_lambert", "ashikhmin_shirley_diffuse", "oren_nayar"}
    assert set(LOBES) == set(bc.MODELS) - diffuse
    compared = bc.compare(measured_from("lambert(kd=0.2) + ward(isotropic, rs=0.1, a=0.2)", count=60))
    assert compared.models[0] == "lambert + ward"
    assert set(compared.models) == {f"lambert + {name}" for name in LOBES}


REFUSED = {
    "none": ({"models": []}, ModelTextError, "models", "got []"),
    "a text": ({"models": "lambert"}, ModelTextError, "models", "a list of texts, got 'lambert'"),
    "unknown": ({"models": ["lambert", "lambrt"]}, UnknownNameError, "model", "Did you mean 'lambert'"),
    "loss": ({"models": ["lambert"], "loss": "cosin"}, UnknownNameError, "loss", "'cosine'"),
    "key": ({"models": MODELS, "fixed": {"ward.a": 1}}, UnknownNameError, "fixed", "'ward_bounded.a'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals_come_before_work(case: str) -> None:
    keywords, kind, field, part = REFUSED[case]
    with pytest.raises(kind) as caught:
        bc.compare(measured_from(TRUE, count=20), **keywords)
    assert isinstance(caught.value, BrdfError)
    assert caught.value.field == field
    assert part in str(caught.value)


def test_unknown_losses_are_refused(compared: bc.Comparison) -> None:
    for call in (lambda: compared.errors("cosin"), lambda: compared.report(["cosin"])):
        with pytest.raises(UnknownNameError, match="Did you mean 'cosine'"):
            call()
