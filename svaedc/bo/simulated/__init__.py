"""Candidates that were simulated before any trial: their outcomes, and priors that are made of them."""
