"""The study of evaluation: its reference, the forms in print, and what it concludes."""

import json
import subprocess
import sys

import mpmath
import numpy as np
import pytest
import torch

from brdfcore.study import STUDIES, _ward_methods
from brdfcore.study._textbook import exact, relative_errors, walter_3, walter_4, ward_5b
from brdfcore.study.evaluation import _sentence

SHAPE = {"rs": 0.3, "ax": 0.05, "ay": 0.1}


def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    wi, wo = _ward_methods.directions(SHAPE["ax"], count, seed=1)
    return wi.numpy(), wo.numpy()


def test_the_reference_is_the_lobe_to_40_digits() -> None:
    """Against 60 digits of Walter's eq. 3, by the angles of the half vector."""
    wi, wo = pairs(20)
    with mpmath.workdps(60):
        rs, ax, ay = (mpmath.mpf(value) for value in SHAPE.values())
        for i, o, found in zip(wi, wo, exact(wi, wo, **SHAPE), strict=True):
            x, y, z = (mpmath.mpf(a) + mpmath.mpf(b) for a, b in zip(i.tolist(), o.tolist(), strict=True))
            theta, phi = mpmath.acos(z / mpmath.sqrt(x * x + y * y + z * z)), mpmath.atan2(y, x)
            exponent = mpmath.tan(theta) ** 2 * ((mpmath.cos(phi) / ax) ** 2 + (mpmath.sin(phi) / ay) ** 2)
            over = 4 * mpmath.pi * ax * ay * mpmath.sqrt(mpmath.mpf(i[2]) * mpmath.mpf(o[2]))
            expected = rs * mpmath.exp(-exponent) / over
            assert abs(mpmath.mpf(str(found)) / expected - 1) < mpmath.mpf(10) ** -36


def test_errors_are_taken_without_rounding_the_reference() -> None:
    wi, wo = pairs(1)
    (true,) = exact(wi, wo, **SHAPE)
    errors = relative_errors(np.array([float(true) * (1 + 2**-40), np.nan]), [true, true])
    assert errors[0] == pytest.approx(2**-40, rel=1e-3)
    assert np.isinf(errors[1])


def test_the_forms_in_print_are_what_walter_says_of_them() -> None:
    """Eqs. 3 and 4 are equal; Ward's approximation is neither, but nearly so where h is near the normal."""
    wi, wo = pairs(2000)
    vector, angles, approximation = (form(wi, wo, **SHAPE) for form in (walter_4, walter_3, ward_5b))
    np.testing.assert_allclose(angles, vector, rtol=1e-10)
    off = np.abs(approximation / vector - 1)
    h = wi + wo
    slope2 = (h[:, 0] ** 2 + h[:, 1] ** 2) / h[:, 2] ** 2
    assert off.max() > 0.01
    assert off[slope2 < 1e-4].max() < 1e-3


def test_directions_are_above_the_horizon_where_the_lobe_is() -> None:
    wi, wo = pairs(500)
    assert len(wi) == len(wo) == 500
    assert min(wi[:, 2].min(), wo[:, 2].min()) >= 1e-3
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, rtol=1e-12)
    h = wi + wo
    assert (((h[:, 0] / 0.05) ** 2 + (h[:, 1] / 0.1) ** 2) / h[:, 2] ** 2).max() < 20


def test_a_small_study_finds_what_is_known() -> None:
    study = STUDIES["evaluation"](quick=True, widths=(0.001, 0.5), count=300, checked=300, repeats=1)
    largest = {(row[0], row[1], row[2]): row[5] for row in study.rows}
    assert len(study.rows) == 2 * 2 * 5
    for width in (0.001, 0.5):
        assert largest[(width, "brdfcore, chunked", "float64")] < 2e-14
        assert largest[(width, "brdfcore, chunked", "float32")] < 5e-6
    assert largest[(0.001, "NumPy, eq. 3 (textbook)", "float32")] > 0.01, "arccos near 1"
    assert largest[(0.5, "NumPy, Ward's approximation", "float64")] > 0.5
    assert all(row[3] > 0 for row in study.rows)
    assert len(study.charts[0].panels) == 2
    assert "Not compiled, as --quick asks." in study.notes


@pytest.mark.full
def test_compiled_values_are_right() -> None:
    """Also that the study says what compiling cost; in a process whose annotations are not checked while it runs."""
    code = (
        "import json; from brdfcore.study import STUDIES, report\n"
        "made = STUDIES['evaluation'](widths=(0.03,), count=4096, checked=100, repeats=1)\n"
        "print(json.dumps(report.to_dict(made)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    study = json.loads(done.stdout)
    largest = {row[2]: row[5] for row in study["rows"] if row[1] == _ward_methods.COMPILED}
    assert largest["float64"] < 2e-14
    assert largest["float32"] < 5e-6
    assert any(note.startswith("Compiling") for note in study["notes"])


def rows(single: float, double: float) -> list[tuple]:
    """A table in which the library's float32 and float64 take these times."""
    table = []
    for kind, error, own in (("float64", 1e-15, double), ("float32", 1e-6, single)):
        table += [(0.1, name, kind, 100.0, 1.0, error, error) for name in _ward_methods.PRINTED]
        table.append((0.1, _ward_methods.EAGER, kind, 2 * own, 1.0, error, error))
        table.append((0.1, _ward_methods.CHUNKED, kind, own, 1.0, error, error))
    return table


def test_the_sentence_is_computed() -> None:
    half = _sentence(rows(single=20.0, double=40.0), 0.01, 3e-4)
    assert "Take float64 chunked (relative error 1e-15, 0.4x the textbook's time)" in half
    assert "float32 chunked costs 0.5x of that, is good to 1e-06" in half
    assert "up to 0.0003 at width 0.01" in half
    assert "float32 chunked saves no time" in _sentence(rows(single=40.0, double=40.0), 0.01, 3e-4)
    dear = rows(single=40.0, double=40.0)
    dear[3] = (*dear[3][:3], 1.0, *dear[3][4:])  # eager float64 becomes the fastest
    assert "Take float64 eager" in _sentence(dear, 0.01, 3e-4)


def test_the_reference_of_float32_directions_is_their_own() -> None:
    """The error of float32 arithmetic is not that of rounding its input."""
    wi, wo = (torch.from_numpy(w) for w in pairs(50))
    single = exact(wi.float().numpy(), wo.float().numpy(), **SHAPE)
    double = exact(wi.numpy(), wo.numpy(), **SHAPE)
    assert max(abs(float(s / d - 1)) for s, d in zip(single, double, strict=True)) > 1e-7
