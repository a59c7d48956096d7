"""A lit sphere over HTTP: the library's pixels, its colours, and a sentence for everything else."""

from typing import Any

import pytest
import torch
from starlette.testclient import TestClient

import brdfcore as bc
from brdfcore.render import lit_sphere, to_rgb
from brdfcore.render.image import encoded, png

TEXT = "lambert(kd=[0.5, 0.2, 0.1]) + ward_bounded(isotropic, rs=0.1, a=0.2)"
MANY = f"lambert(kd={[0.1 * k for k in range(1, 6)]})"


def test_a_sphere_is_the_librarys(http: TestClient) -> None:
    material = bc.material(TEXT)
    with torch.no_grad():
        pixels = lit_sphere(material, 24)
    for given in (TEXT, material.to_json()):
        answer = http.post("/v1/sphere", json={"material": given, "size": 24})
        assert (answer.status_code, answer.headers["content-type"]) == (200, "image/png")
        assert answer.content == png(encoded(pixels, 1.0))
    spectrum = ["620", "550 nm", "460nm"]
    rgb = to_rgb(pixels, spectrum)
    assert rgb is not None
    body = {"material": TEXT, "size": 24, "channels": spectrum}
    assert http.post("/v1/sphere", json=body).content == png(encoded(rgb, 1.0))
    with torch.no_grad():
        gray = lit_sphere(bc.material(MANY), 24)[..., 3:4].expand(24, 24, 3)
    answer = http.post("/v1/sphere", json={"material": MANY, "size": 24, "channel": 3})
    assert answer.content == png(encoded(gray, 1.0))
    bad: tuple[tuple[dict[str, Any], str, str], ...] = (
        ({"material": "lambet"}, "material", "Did you mean 'lambert'?"),
        ({"material": f"lambert(kd={[0.1] * 65})"}, "material", "at most 64 channels, got 65"),
        ({"channels": ["r"]}, "channels", "to name the material's 3, got 1"),
        ({"channel": 3}, "channel", "below 3, got 3"),
        ({"size": 1024}, "size", "less than or equal to 512"),
    )
    for change, field, words in bad:
        answer = http.post("/v1/sphere", json={"material": TEXT} | change)
        assert (answer.status_code, answer.json()["field"]) == (422, field)
        assert words in answer.json()["detail"]
    assert http.post("/v1/sphere", json={"material": TEXT}, headers={"accept": "image/svg+xml"}).status_code == 406


@pytest.mark.parametrize("count", [3, 31])
def test_an_even_spectrum_is_gray(count: int) -> None:
    names = [f"{400 + 300 * k / (count - 1):g}" for k in range(count)]
    rgb = to_rgb(torch.full((2, count), 0.4, dtype=torch.float64), names)
    assert rgb is not None
    torch.testing.assert_close(rgb, torch.full((2, 3), 0.4, dtype=torch.float64), rtol=1e-12, atol=0)
