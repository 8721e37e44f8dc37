"""Robots and the things around them: what is observed, what is commanded, and where every number comes from."""
