"""The routes, one file a resource."""

from . import albedo, datasets, evaluate, export, fits, health, models, plots

ROUTERS = (
    datasets.router,
    fits.router,
    plots.router,
    export.router,
    albedo.router,
    evaluate.router,
    models.router,
    health.router,
)
