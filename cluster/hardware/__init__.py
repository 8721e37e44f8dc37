"""Campaigns on one robot: the journal, the one process that moves it, and what a person decides."""
