"""The routes, one file a resource."""

from . import albedo, batches, datasets, evaluate, events, fits, formats, health, models, plots

ROUTERS = (
    datasets.router,
    fits.router,
    events.router,
    batches.router,
    plots.router,
    albedo.router,
    evaluate.router,
    models.router,
    formats.router,
    health.router,
)
