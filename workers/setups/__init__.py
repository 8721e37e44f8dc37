"""Setups by name: a robot, its controller and its task, those that ship and a user's own."""

from workers.setups.registry import SETUPS, file_digest, import_user_module, load
from workers.setups.setup import Setup, require_known

__all__ = ["SETUPS", "Setup", "file_digest", "import_user_module", "load", "require_known"]
