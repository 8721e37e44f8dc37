"""The chaos tests kill the same processes as the hardware tests, and tear machines from the same cluster."""

from tests.cluster.conftest import machines
from tests.cluster.hardware.conftest import processes

__all__ = ["machines", "processes"]
