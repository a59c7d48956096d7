"""Scenes: a small, exact, differentiable preview that simulates only the effects that a scene calls for.

    scene = bc.render.Scene.load("furnace")          # or a file's path
    print(bc.render.plan(scene))                     # what is simulated, and why
    bc.render.render(scene).save("furnace.png")

Spheres, planes and rectangles with the library's own materials, and lights with and without an extent. Out of scope:
meshes, and the frame rates of a graphics card.
"""

from .camera import Camera
from .colours import to_rgb
from .effects import Effect, Plan
from .image import Image, psnr
from .lights import Directional, Dome, Point, RectangleLight, SphereLight
from .plan import everything, plan
from .progressive import render
from .scene import LIGHTS, SCENES, SHAPES, Scene
from .shapes import Plane, Rectangle, Sphere
from .sphere import lit_sphere

__all__ = [
    "LIGHTS",
    "SCENES",
    "SHAPES",
    "Camera",
    "Directional",
    "Dome",
    "Effect",
    "Image",
    "Plan",
    "Plane",
    "Point",
    "Rectangle",
    "RectangleLight",
    "Scene",
    "Sphere",
    "SphereLight",
    "everything",
    "lit_sphere",
    "plan",
    "psnr",
    "render",
    "to_rgb",
]
