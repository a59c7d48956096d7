"""The header row: names, delimiters, what must be there."""

import pytest

from brdfcore.errors import FormatError
from brdfcore.formats._header import is_direction, parse_header, split_header

ANGLES = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg"
VECTORS = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"


@pytest.mark.parametrize(
    ("line", "delimiter"),
    [("a,b c,d", ","), ("a;b,c;d", ";"), ("a\tb\tc,d", "\t"), ("  a  b c ", None), ("a\t b", "\t")],
)
def test_delimiter(line: str, delimiter: str | None) -> None:
    assert split_header(line)[0] == delimiter


def test_names_are_stripped_of_case_blanks_and_quotes() -> None:
    assert split_header(' "Theta_I_deg" , R') == (",", ("theta_i_deg", "r"))


def test_every_role_finds_its_column() -> None:
    header = parse_header("value,phi_s_deg,theta_s_rad,weight,theta_i,phi_i_deg,sigma,cell")
    assert header.directions == {"phi_o": 1, "theta_o": 2, "theta_i": 4, "phi_i": 5}
    assert header.units == {"phi_o": "degrees", "theta_o": "radians", "theta_i": None, "phi_i": "degrees"}
    assert (header.channels, header.values, header.sigma) == (("value",), [0], [6])
    assert header.extras == {"weight": 3, "cell": 7}


@pytest.mark.parametrize(
    ("names", "channels", "values", "sigma"),
    [
        ("b,r,g", ("r", "g", "b"), [7, 8, 6], []),
        ("550,450.5,1064", ("550", "450.5", "1064"), [6, 7, 8], []),
        ("sigma_500,500,400,sigma_400", ("500", "400"), [7, 8], [6, 9]),
        ("sigma_value,value", ("value",), [7], [6]),
        ("r,g,b,sigma", ("r", "g", "b"), [6, 7, 8], [9]),
    ],
)
def test_channels(names: str, channels: tuple[str, ...], values: list[int], sigma: list[int]) -> None:
    header = parse_header(f"{VECTORS},{names}")
    assert (header.channels, header.values, header.sigma) == (channels, values, sigma)


@pytest.mark.parametrize(
    ("line", "words", "field"),
    [
        (f"{ANGLES},value,temperature", "column 6 of the header to be a known name, got 'temperature'", "temperature"),
        (f"{ANGLES},value,", "column 6 of the header to be a known name, got ''", ""),
        (f"{ANGLES},-550", "column 5 of the header to be a known name, got '-550'", "-550"),
        (f"{ANGLES},value,value", "every column to be there once, got 'value' again", "value"),
        (f"{ANGLES},theta_r_deg,value", "every column to be there once, got 'theta_r_deg' again", "theta_r_deg"),
        ("theta_i,phi_i,theta_o,value", "the header to name theta_i, phi_i, theta_o, phi_o, and no other", "phi_o"),
        ("wi_x,wi_y,wi_z,wo_x,wo_z,value", "got wi_x, wi_y, wi_z, wo_x, wo_z. Columns are", "wo_y"),
        (f"{ANGLES},{VECTORS},value", "and no other direction, got theta_i, phi_i", "wi_x"),
        ("value,r", "no other direction, got none of them", "theta_i"),
        (ANGLES, "the value columns to be value, or r, g, b, or distinct wavelengths in nm, got none.", "values"),
        (f"{ANGLES},r,g", "got r, g.", "values"),
        (f"{ANGLES},value,550", "got value, 550.", "values"),
        (f"{ANGLES},550,550.0", "got 550, 550.0.", "values"),
        (
            f"{ANGLES},r,g,b,sigma_r,sigma_g",
            "one a channel (sigma_r, sigma_g, sigma_b), got sigma_r, sigma_g.",
            "sigma",
        ),
        (f"{ANGLES},r,g,b,sigma,sigma_r", "got sigma, sigma_r.", "sigma"),
    ],
)
def test_bad_headers_are_refused(line: str, words: str, field: str) -> None:
    with pytest.raises(FormatError) as caught:
        parse_header(line)
    assert words in str(caught.value)
    assert caught.value.field == field


@pytest.mark.parametrize("name", ["theta_i", "phi_s_deg", "theta_r_rad", "wi_x", "wo_z"])
def test_directions(name: str) -> None:
    assert is_direction(name)


@pytest.mark.parametrize("name", ["theta", "theta_h", "wi", "phi_i_grad", "value", ""])
def test_no_directions(name: str) -> None:
    assert not is_direction(name)
