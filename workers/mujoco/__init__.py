"""Simulations in MuJoCo, the second engine; it is an extra, and no other room imports it."""
