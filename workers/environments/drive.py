"""How commands move the joints of an arm: as torques or as speeds."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from workers.simulation.arm import Arm


class Drive(ABC):
    """What a command means, one number per moving joint.

    Attributes:
        limits: greatest magnitude of each number; commands lie within ± limits.
        unit: of the numbers.
    """

    limits: tuple[float, ...]
    unit: ClassVar[str]

    @abstractmethod
    def bind(self, arm: Arm) -> Callable[[Sequence[float]], None]:
        """The function that gives the arm its command for the next step."""


@dataclass(frozen=True)
class TorqueDrive(Drive):
    """Commands are joint torques.

    Attributes:
        limits: N·m.
    """

    limits: tuple[float, ...]
    unit: ClassVar[str] = "N·m"

    def bind(self, arm: Arm) -> Callable[[Sequence[float]], None]:
        """See `Arm.apply_torque`."""
        return arm.apply_torque


@dataclass(frozen=True)
class SpeedDrive(Drive):
    """Commands are joint speeds, which motors try to reach within one step.

    Attributes:
        limits: rad/s.
        force: N·m that each motor has for it.
    """

    limits: tuple[float, ...]
    force: float
    unit: ClassVar[str] = "rad/s"

    def bind(self, arm: Arm) -> Callable[[Sequence[float]], None]:
        """See `Arm.apply_speed`."""
        forces = [self.force] * len(self.limits)

        def apply(speed: Sequence[float]) -> None:
            arm.apply_speed(speed, forces)

        return apply
