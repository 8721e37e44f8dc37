"""Setups by name: a robot, its controller and its task, those that ship and a user's own."""

from workers.setups.registry import SETUPS, file_digest, imported, load
from workers.setups.setup import Setup, known

__all__ = ["SETUPS", "Setup", "file_digest", "imported", "known", "load"]
