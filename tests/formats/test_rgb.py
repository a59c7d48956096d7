"""Measured spectra as red, green and blue: samples, tables, the command line, and on to a renderer."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from rgl_file import rgl_arrays, rgl_bytes, tensor_file

import brdfcore as bc
from brdfcore import colour
from brdfcore.cli import main
from brdfcore.errors import InvalidValueError, SamplesError

NAMES = [f"{nm} nm" for nm in range(400, 701, 25)]
SPECTRAL = tensor_file(rgl_arrays(wavelengths=tuple(range(380, 741, 20))))

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def spectrum(generator: torch.Generator) -> bc.Samples:
    """Five samples in 13 channels with all that samples can have."""
    draw = [torch.rand(5, n, generator=generator, dtype=torch.float64) for n in (1, 1, 13, 13)]
    zero = torch.zeros(5, dtype=torch.float64)
    return bc.Samples.from_angles(
        draw[0][:, 0],
        zero,
        draw[1][:, 0],
        zero,
        draw[2],
        unit="radians",
        channels=NAMES,
        sigma=0.1 + draw[3],
        weight=zero + 2,
        cell=zero + 0.5,
        masked=[bc.formats.Masked("night", 3)],
        source="somewhere",
        format="csv",
        azimuth_observed=True,
    )


def test_samples_turn_into_linear_srgb_and_keep_all_else(spectrum: bc.Samples) -> None:
    rgb, weights = spectrum.to_rgb(), colour.weights(torch.arange(400, 701, 25))
    assert rgb.channels == ("r", "g", "b")
    torch.testing.assert_close(rgb.values, spectrum.values @ weights, rtol=1e-14, atol=0)
    assert spectrum.sigma is not None
    for k in range(3):  # of independent errors
        by_hand = sum((spectrum.sigma[:, c] * weights[c, k]) ** 2 for c in range(13)) ** 0.5
        torch.testing.assert_close(rgb.sigma[:, k], by_hand)  # type: ignore[index]
    for name in ("wi", "wo", "weight", "cell", "masked", "source", "format", "azimuth_observed", "quantity"):
        assert getattr(rgb, name) is getattr(spectrum, name)
    assert rgb.to_rgb() is rgb
    assert len({spectrum.hash, rgb.hash, rgb.subset(torch.tensor([0])).hash}) == 3
    assert spectrum.channels == tuple(NAMES), "the samples themselves are as they were"
    white = bc.Samples(spectrum.wi, spectrum.wo, torch.full((5, 13), 0.25), NAMES).to_rgb()
    torch.testing.assert_close(white.values, torch.full((5, 3), 0.25).double(), rtol=1e-14, atol=0)
    assert white.sigma is None


def test_others_than_spectra_are_refused(spectrum: bc.Samples) -> None:
    with pytest.raises(SamplesError, match=r"by wavelengths in nm, got c0, c1, c2, c3, \.\.\.") as refused:
        bc.Samples(spectrum.wi, spectrum.wo, spectrum.values).to_rgb()
    assert refused.value.field == "rgb"


def test_a_spectral_table_is_a_material_in_rgb(tmp_path: Path) -> None:
    path = tmp_path / "spectral.bsdf"
    path.write_bytes(SPECTRAL)
    spectral, rgb = bc.Tabulated.read(path), bc.Tabulated.read(path, rgb=True)
    assert (spectral.channels, rgb.channel_names) == (19, ("r", "g", "b"))
    wi, wo = torch.tensor([[0.6, 0.0, 0.8]]).double(), torch.tensor([[-0.48, 0.36, 0.8]]).double()
    weights = colour.of_spectrum(spectral.channel_names)
    torch.testing.assert_close(rgb.f(wi, wo), spectral.f(wi, wo) @ weights, rtol=1e-12, atol=0)
    assert torch.equal(rgb.pdf(wi, wo), spectral.pdf(wi, wo))
    samples = bc.read(path, rgb=True)
    torch.testing.assert_close(samples.values, bc.read(path).values @ weights, rtol=1e-12, atol=1e-15)
    path.write_bytes(rgl_bytes())
    assert torch.equal(bc.Tabulated.read(path, rgb=True).f(wi, wo), bc.Tabulated.read(path).f(wi, wo))


def test_a_material_of_a_spectrum_is_told_how_to_be_exported() -> None:
    with pytest.raises(InvalidValueError, match=r"got 5\. Fit its spectrum as red, green and blue \(brdf fit --rgb"):
        bc.export(bc.material("lambert(kd=[0.1, 0.2, 0.3, 0.4, 0.5])"), "radiance")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Run:
    """Runs a command in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def typed(*arguments: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["brdf", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return typed


def test_from_a_measured_spectrum_to_a_renderer(run: Run, measured: Path) -> None:
    """Garnet red: what an engineer types, from the goniometer's 31 channels to Radiance's three."""
    file, model = measured / "cornell" / "garnet_red.brdf", "lambert + ward_bounded"
    code, out, err = run("convert", file, "garnet.npz", "--rgb")
    assert (code, err) == (0, "")
    assert out == (
        "garnet.npz: 1,439 samples of the BRDF [1/sr] in 3 channels\n"
        "red, green and blue (linear sRGB under D65) of 31 wavelengths, 400 to 700 nm, 99.7% of what the eye sees\n"
    )
    assert torch.equal(bc.read("garnet.npz").values, bc.read(file, rgb=True).values)
    code, out, err = run("fit", file, "--rgb", "--model", model, "--json")
    assert (code, err) == (0, "")
    Path("garnet.json").write_text(out)
    kd = json.loads(out)["parameters"]["lambert.kd"]
    assert kd[0] > 0.1
    assert max(kd[1:]) < 0.05 * kd[0], "a deep red"
    code, out, err = run("export", "garnet.json", "garnet.rad", "--to", "radiance")
    assert (code, err) == (0, "")
    assert "WGMDfunc. Exact" in out
    assert Path("garnet.rad").stat().st_size > 500
    code, out, _ = run("compare", file, "--rgb", "--models", "lambert", "--json")
    assert code == 0
    assert json.loads(out)["ranking"][0]["parameters"] == 3, "one a channel"
    code, _, err = run("convert", measured / "nist_ptfe" / "PTFE.data.csv", "ptfe.npz", "--rgb")
    assert code == 2
    assert "lie at most 30 nm apart, got a step of 152 nm." in err
