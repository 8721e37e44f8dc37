"""Setups by name: a robot, its controller and its task, those that ship and a user's own.

What a setup is made of is imported when it is first asked for: names alone cost no time.
"""

from typing import TYPE_CHECKING, Any

from workers.setups.names import SETUPS, require_known
from workers.setups.registry import file_digest, import_user_module, load

if TYPE_CHECKING:
    from workers.setups.setup import Setup

__all__ = ["SETUPS", "Setup", "file_digest", "import_user_module", "load", "require_known"]


def __getattr__(name: str) -> Any:
    if name == "Setup":
        from workers.setups.setup import Setup

        return Setup
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
