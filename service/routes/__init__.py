"""The routes, one file a resource."""

from . import albedo, datasets, evaluate, fits, formats, health, models, plots

ROUTERS = (
    datasets.router,
    fits.router,
    plots.router,
    albedo.router,
    evaluate.router,
    models.router,
    formats.router,
    health.router,
)
