"""A PyBullet server of this process, whatever it is for."""

from types import TracebackType
from typing import TypeVar

from workers.simulation.bullet import pybullet

Kind = TypeVar("Kind", bound="Server")


class Server:
    """Runs in memory and needs no screen; ends with a `with` block, or when it is closed."""

    def __init__(self) -> None:
        self.client: int = pybullet.connect(pybullet.DIRECT)

    def __enter__(self: Kind) -> Kind:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the server; closing twice is harmless."""
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1
