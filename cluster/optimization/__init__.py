"""What a run of Bayesian optimisation is made from: methods and models by name, and one factory."""
