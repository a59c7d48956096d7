"""The HTTP service around brdfcore: datasets, fits as durable jobs, plots, and a client that needs no torch."""
