"""The routes, one file a resource."""

from . import (
    albedo,
    batches,
    datasets,
    docs,
    evaluate,
    events,
    export,
    fits,
    formats,
    health,
    models,
    page,
    plots,
    renders,
    sphere,
)

ROUTERS = (
    datasets.router,
    fits.router,
    events.router,
    batches.router,
    plots.router,
    export.router,
    albedo.router,
    renders.router,
    evaluate.router,
    sphere.router,
    models.router,
    formats.router,
    health.router,
    page.router,
    docs.router,
)
