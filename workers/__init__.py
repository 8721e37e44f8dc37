"""Rollouts of parametric controllers on simulated and real robots, and the dataset they are stored in."""
