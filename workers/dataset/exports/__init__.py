"""The dataset in formats of others."""
