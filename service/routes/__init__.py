"""The routes, one file a resource."""

from . import datasets, fits, health, models, plots

ROUTERS = (datasets.router, fits.router, plots.router, models.router, health.router)
