"""The routes, one file a resource."""

from . import albedo, batches, datasets, evaluate, events, fits, health, models, page, plots

ROUTERS = (
    datasets.router,
    fits.router,
    events.router,
    batches.router,
    plots.router,
    albedo.router,
    evaluate.router,
    models.router,
    health.router,
    page.router,
)
