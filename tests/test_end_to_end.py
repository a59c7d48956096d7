"""The same measurement through the library, the command line and HTTP: the same numbers each way."""

import json
import pathlib
import sys
from collections.abc import Iterator

import numpy as np
import pytest
from reconstruction import merl_reconstruction

import brdfcore as bc
from brdfcore.cli import main
from brdfcore.cli.serve import background
from service.client import Client
from service.settings import Settings

MODELS = [
    "lambert + ward_bounded",
    "lambert + kurt",
    "ashikhmin_shirley + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)",
]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    settings = Settings(data=tmp_path_factory.mktemp("service"), port=0, workers=1)
    with background(settings) as url, Client(url) as client:
        yield client


def numbers(result: dict[str, object]) -> list[float]:
    """Every parameter, interval end and error, in order; nothing else."""

    def leaves(x: object) -> Iterator[float]:
        if isinstance(x, dict):
            for value in x.values():
                yield from leaves(value)
        elif isinstance(x, list | tuple):
            for value in x:
                yield from leaves(value)
        elif x is not None:
            yield float(x)  # type: ignore[arg-type]

    return [n for name in ("parameters", "intervals", "errors", "objective") for n in leaves(result[name])]


@pytest.mark.parametrize("model", MODELS)
def test_garnet_red_gives_the_same_numbers_each_way(
    measured: pathlib.Path,
    model: str,
    client: Client,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = measured / "cornell" / "garnet_red.brdf"
    library = bc.fit(bc.read(file), model).to_dict()
    monkeypatch.setattr(sys, "argv", ["brdf", "fit", str(file), "--model", model, "--json"])
    with pytest.raises(SystemExit):
        main()
    typed = json.loads(capsys.readouterr().out)
    posted = client.fit(file, model=model).result.model_dump()
    assert library["status"] == typed["status"] == posted["status"] == "converged"
    assert len(numbers(library)) > 100
    # the service computes with one thread, which sums in another order: digits beyond the optimum's own may differ
    assert numbers(typed) == pytest.approx(numbers(library), rel=1e-12)
    assert numbers(posted) == pytest.approx(numbers(library), rel=1e-6)
    assert posted["provenance"] == library["provenance"]


def test_a_merl_file_goes_through_http(measured: pathlib.Path, client: Client, tmp_path: pathlib.Path) -> None:
    """Streamed upload, invalid bins masked and reported, fitted, plotted."""
    file = tmp_path / "blue-metallic-paint.binary"
    content = merl_reconstruction(measured, "blue-metallic-paint")
    file.write_bytes(content)
    invalid = int((np.frombuffer(content, "<f8", offset=12).reshape(3, -1) < 0).any(0).sum())
    fit = client.fit(file, model="lambert + ward_bounded", loss="l2")
    result = fit.result.model_dump()
    assert result["status"] == "converged"
    assert result["data"]["masked"] == [
        {"reason": "value is negative, which MERL uses for invalid bins", "count": invalid}
    ]
    assert result["data"]["samples"] == 90 * 90 * 180 - invalid
    assert result["channels"] == ["r", "g", "b"]
    assert result["model"] == "lambert + ward_bounded(isotropic)"
    blue, red = result["parameters"]["ward_bounded.rs"][2], result["parameters"]["ward_bounded.rs"][0]
    assert blue > red, "a blue metallic paint"
    assert fit.plot("lobes", "png").startswith(b"\x89PNG")
