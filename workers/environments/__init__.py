"""Robots and the things around them: what is observed, what is commanded, what every number is."""
