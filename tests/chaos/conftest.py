"""The chaos tests kill the same processes as the hardware tests."""

from tests.cluster.hardware.conftest import processes

__all__ = ["processes"]
