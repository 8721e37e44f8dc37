"""Parametric controllers: a vector in the unit cube becomes commands over time."""
