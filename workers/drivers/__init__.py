"""Drivers of real robots: each runs in an environment of its own, and nothing here imports them."""
