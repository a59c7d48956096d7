"""Durable jobs: the store is the truth, a runner computes, the dispatcher stands between them."""
