"""SVAE-DC: latent paths of trajectories, learnt in simulation, and Bayesian optimisation on top of them."""
