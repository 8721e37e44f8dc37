"""The extra that brings MuJoCo; asking for it costs no import of it."""

from importlib.util import find_spec

PACKAGES = ("mujoco",)
"""Versions of these decide the bytes of an episode."""
NEEDED = (*PACKAGES, "numba")


class MissingExtraError(LookupError):
    """A package is missing that is no requirement of every installation; the message names its extra."""


def require_installed() -> None:
    """Refuse to go on without the packages of the extra.

    Raises:
        MissingExtraError: one of them is not there.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise MissingExtraError(
            f"setups in MuJoCo need the package {missing[0]}, which is not installed; install the extra: "
            "pip install 'svaedc[mujoco]'"
        )
