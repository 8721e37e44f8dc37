"""Objectives and bad conditions, as functions of what was observed."""
