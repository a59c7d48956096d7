"""A rendered image: linear radiance, its noise, what made it, and its files."""

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from ..errors import InvalidValueError
from ._exr import exr
from .effects import Plan

SUFFIXES = (".png", ".npy", ".exr")


@dataclass(frozen=True, eq=False)
class Image:
    """Radiance and its standard errors, in the scene's unit, and what they cost."""

    pixels: Tensor  # (H, W, 3) linear
    noise: Tensor  # (H, W, 3) standard errors, 0 where nothing is random
    plan: Plan
    samples: int  # a ray, that were taken; 0 where nothing is random
    seconds: float

    @property
    def luminance(self) -> Tensor:
        """The relative luminance (H, W) of Rec. 709 primaries."""
        return (self.pixels * self.pixels.new_tensor([0.2126, 0.7152, 0.0722])).sum(-1)

    def save(self, path: str | Path) -> Path:
        """The path of the file that was written: .npy and .exr hold linear float32, .png the exposed, encoded image."""
        path = Path(path)
        check_path(path)
        pixels = self.pixels.detach().cpu()
        if path.suffix == ".npy":
            np.save(path, pixels.float().numpy())
        elif path.suffix == ".exr":
            path.write_bytes(exr(pixels.float().numpy()))
        else:
            path.write_bytes(png(encoded(pixels, self.plan.scene.exposure)))
        return path


def check_path(path: Path) -> None:
    """Raise where a path does not end in a known suffix, or lies in a folder that does not exist."""
    if path.suffix not in SUFFIXES:
        raise InvalidValueError(
            f"Expected the image's file to end in {', '.join(SUFFIXES)}, got {path.name!r}. Rename it.", field="path"
        )
    if not path.parent.is_dir():
        raise InvalidValueError(
            f"Expected the image's folder to exist, got {str(path.parent)!r}. Make it first.", field="path"
        )


def srgb(pixels: Tensor, exposure: float) -> Tensor:
    """Linear pixels, exposed, on sRGB's curve (IEC 61966-2-1), in [0, 1]; what exceeds white is white."""
    x = (pixels * exposure).clamp(0, 1)
    return torch.where(x <= 0.0031308, 12.92 * x, 1.055 * x.clamp(min=0.0031308) ** (1 / 2.4) - 0.055)


def encoded(pixels: Tensor, exposure: float) -> Tensor:
    """The bytes (H, W, 3) of linear pixels on that curve."""
    return (255 * srgb(pixels, exposure)).round().to(torch.uint8)


def psnr(image: Image, reference: Image) -> float:
    """The peak signal-to-noise ratio [dB] of an image as it is seen: exposed, on sRGB's curve, not rounded.

    The mean of 20 log10(1 / root mean square error) over the channels, at most 200. Both are exposed as the reference.
    """
    exposure = reference.plan.scene.exposure
    off = srgb(image.pixels.detach(), exposure) - srgb(reference.pixels.detach(), exposure)
    return float((-10 * torch.log10(off.square().mean((0, 1)).clamp(min=1e-20))).mean())


def png(rows: Tensor) -> bytes:
    """The PNG file of bytes (H, W, 3)."""
    height, width, _ = rows.shape
    raw = b"".join(b"\0" + rows[y].numpy().tobytes() for y in range(height))  # no filter

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")
