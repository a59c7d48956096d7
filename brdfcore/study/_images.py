"""What the parts of the study of images share: timed images, and the row of each."""

import dataclasses
import time

from ..render import Image, Plan, Scene, psnr
from ..render import render as image_of
from ._study import Cell

COLUMNS = (
    "case",
    "what",
    "samples",
    "time [s]",
    "relative error [1]",
    "PSNR [dB]",
    "variance of a sample [1]",
)
EXACT = 150.0  # dB, from which on there is nothing left to see or to tell


def timed(scene: Scene, chosen: Plan, seed: int) -> tuple[Image, float]:
    """An image under a plan of this scene or of one with other samples, and its seconds."""
    begun = time.perf_counter()
    image = image_of(scene, dataclasses.replace(chosen, scene=scene), seed=seed)
    return image, time.perf_counter() - begun


def error(image: Image, reference: Image) -> float:
    """The root mean square difference, as a share of the reference's mean."""
    return float((image.pixels - reference.pixels).square().mean().sqrt() / reference.pixels.mean())


def row(case: str, what: str, image: Image, seconds: float, reference: Image) -> tuple[Cell, ...]:
    """The row of an image; the variance is the mean one of a sample, as a share of the mean's square."""
    ratio = psnr(image, reference)
    variance = float(image.noise.square().mean() / reference.pixels.mean().square()) * image.samples
    return (case, what, image.samples, seconds, error(image, reference), ratio if ratio < EXACT else None, variance)
