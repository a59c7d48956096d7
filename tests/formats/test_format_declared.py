"""Declarations: file and argument must agree, and one of them must speak."""

import pytest

from brdfcore.errors import FormatError, UnknownNameError
from brdfcore.formats import QUANTITIES
from brdfcore.formats._declared import declared


@pytest.mark.parametrize(("in_file", "argument"), [("brdf_cos", None), (None, "brdf_cos"), ("brdf_cos", "brdf_cos")])
def test_either_may_declare(in_file: str | None, argument: str | None) -> None:
    assert declared("quantity", QUANTITIES, in_file, argument, "") == "brdf_cos"


def test_disagreement_is_an_error() -> None:
    with pytest.raises(FormatError, match="quantity to be 'brdf' as the file has it, got 'brdf_cos'") as caught:
        declared("quantity", QUANTITIES, "brdf", "brdf_cos", "")
    assert caught.value.field == "quantity"


def test_silence_is_an_error_that_says_how_to_declare() -> None:
    with pytest.raises(FormatError, match=r"to be declared \('brdf', .*\), got nothing\. Say it aloud\.") as caught:
        declared("quantity", QUANTITIES, None, None, "Say it aloud.")
    assert caught.value.field == "quantity"


def test_a_file_with_an_unknown_name_is_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"got 'brfd'\. Did you mean 'brdf'\?") as caught:
        declared("quantity", QUANTITIES, "brfd", None, "")
    assert caught.value.field == "quantity"
