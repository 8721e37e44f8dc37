"""Bayesian optimisation on latent paths, and the methods it competes with."""
