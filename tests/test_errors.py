"""The exception tree and the sentences that it carries."""

import copy
import pickle

import pytest

from brdfcore import errors
from brdfcore.errors import (
    BrdfError,
    FormatError,
    InvalidValueError,
    ModelTextError,
    ParameterError,
    SamplesError,
    UnknownNameError,
    unknown_name,
)

VALUES = [InvalidValueError, ParameterError, ModelTextError, SamplesError, FormatError]


@pytest.mark.parametrize("kind", VALUES)
def test_bad_values_are_value_errors(kind):
    assert issubclass(kind, InvalidValueError)
    assert issubclass(kind, BrdfError)
    assert issubclass(kind, ValueError)


def test_unknown_names_are_key_errors():
    assert issubclass(UnknownNameError, BrdfError)
    assert issubclass(UnknownNameError, KeyError)
    assert not issubclass(UnknownNameError, ValueError)


def test_the_tree_in_the_docstring_is_the_tree():
    tree = errors.__doc__
    kinds = [value for value in vars(errors).values() if isinstance(value, type) and issubclass(value, BrdfError)]
    assert len(kinds) == 7
    for kind in kinds:
        assert kind.__name__ in tree
        assert kind.__doc__


@pytest.mark.parametrize("kind", [BrdfError, *VALUES, UnknownNameError])
def test_every_error_prints_its_sentence_and_names_its_field(kind):
    error = kind("Expected kd to be in [0, 1], got 2. Lower it.", field="lambert.kd")
    assert str(error) == error.message == "Expected kd to be in [0, 1], got 2. Lower it."
    assert error.field == "lambert.kd"
    assert kind("It broke.").field is None
    with pytest.raises(BrdfError, match=r"^Expected kd"):
        raise error


@pytest.mark.parametrize("kind", [BrdfError, *VALUES, UnknownNameError])
@pytest.mark.parametrize("how", [copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
def test_errors_cross_process_boundaries(kind, how):
    error = how(kind("It broke.", field="kd"))
    assert type(error) is kind
    assert str(error) == error.message == "It broke."
    assert error.field == "kd"


def test_unknown_name_lists_the_known_and_the_nearest():
    error = unknown_name("a model", "kert", ["lambert", "kurt"], field="model")
    assert type(error) is UnknownNameError
    assert str(error) == "Expected a model to be a known name, got 'kert'. Did you mean 'kurt'? Known: lambert, kurt."
    assert error.field == "model"


def test_unknown_name_without_a_near_one():
    error = unknown_name("a model", "zzz", {"lambert": 1, "kurt": 2})
    assert str(error) == "Expected a model to be a known name, got 'zzz'. Known: lambert, kurt."
    assert error.field is None


def test_unknown_name_takes_any_iterable():
    assert "Known: a, b." in str(unknown_name("a thing", "c", (x for x in "ab")))
