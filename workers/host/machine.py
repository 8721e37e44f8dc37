"""What the host asks of a robot: the class that whoever connects one writes."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from workers.host.limits import HostChannel, RobotLimits

RESTS = ("hold", "sag", "drop", "go on")
"""What motors do: hold their place, sag slowly, drop at once, or go on to where they were sent last."""


@dataclass(frozen=True)
class Rest:
    """What happens to the motors when there are no more commands, each one of `RESTS`.

    Attributes:
        stop: after `RobotMachine.stop`.
        kill: after the host process was killed.
        silence: while the host is alive and sends nothing.
        disconnect: after the connection was closed.
    """

    stop: str
    kill: str
    silence: str
    disconnect: str

    def __post_init__(self) -> None:
        """Refuse what is no answer.

        Raises:
            ValueError: naming what must be declared, and how.
        """
        for event, rest in asdict(self).items():
            if rest not in RESTS:
                raise ValueError(
                    f"a driver must declare what its motors do after {event}, one of {', '.join(RESTS)}, got "
                    f"{rest!r}"
                )

    def __str__(self) -> str:
        return ", ".join(f"{event}: {rest}" for event, rest in asdict(self).items())


@dataclass(frozen=True)
class Plan:
    """What a controller will ask of the robot, before it moves.

    Attributes:
        channels: of every row.
        period: s between two rows.
        rows: values, one row after the other.
        seconds: duration of the whole motion.
    """

    channels: tuple[HostChannel, ...]
    period: float
    rows: Sequence[Sequence[float]]
    seconds: float

    def extremes(self, limits: RobotLimits) -> Iterator[dict[str, Any]]:
        """What each channel is asked for, for people; no row must be beyond the limits.

        Args:
            limits: of the robot.

        Yields:
            Name, kind, unit, lowest and highest value; `fastest`, the greatest change per second; `margin`,
            how far the values stay inside the channel's own limit, or None where it has none.
        """
        for channel, values in zip(self.channels, zip(*self.rows)):  # noqa: B905 - rows were checked
            low, high = min(values), max(values)
            changes = [abs(new - old) for old, new in zip(values, values[1:])]  # noqa: B905, RUF007
            yield {
                **asdict(channel),
                "low": low,
                "high": high,
                "fastest": max(changes, default=0.0) / self.period,
                "margin": limits.margin(channel, low, high),
            }


class Fault(RuntimeError):  # noqa: N818 - a fault is what roboticists call it
    """The robot broke off, stands still, and has no valid objective to report."""


class RobotMachine(ABC):
    """A robot, as its host drives it; all calls come from one thread but for `stop`.

    Attributes:
        rest: what its motors do without commands.
        period: s between two commands.
        channels: of a command, in order.
        folder: of the trial under way: every file that the driver leaves there (what was seen, a video, a
            log) becomes part of the campaign's record.
    """

    rest: ClassVar[Rest]
    period: float
    channels: tuple[HostChannel, ...]
    folder: "Path | None" = None

    @abstractmethod
    def plan(self, x: Sequence[float]) -> Plan:
        """What a controller will ask of the robot; nothing moves.

        Args:
            x: the controller, each parameter in [0, 1].

        Returns:
            The plan, which is checked against the limits.
        """

    @abstractmethod
    def begin(self, x: Sequence[float]) -> None:
        """Get ready to run a controller from the reset pose; nothing moves yet.

        Args:
            x: the controller, each parameter in [0, 1].
        """

    @abstractmethod
    def command(self, step: int) -> "Sequence[float] | None":
        """Compute the next command, perhaps from what was seen; nothing moves.

        Args:
            step: from 0.

        Returns:
            One value per channel; None when the controller has come to its end.
        """

    @abstractmethod
    def send(self, command: Sequence[float]) -> None:
        """Send a command, which was checked, to the robot.

        Args:
            command: one value per channel.

        Raises:
            Fault: the robot broke off by itself and stands still.
        """

    @abstractmethod
    def stop(self) -> None:
        """Bring the robot to rest; may be called at any time, from any thread, and again."""

    @abstractmethod
    def end(self) -> dict[str, Any]:
        """Measure what the motion was worth.

        Returns:
            Plain values: `f`, the objective; `y`, the badness in [0, 1]; `stop`, why it ended early, or "";
            `evidence`, the SHA-256 of the trajectory's bytes.
        """

    def close(self) -> None:  # noqa: B027 - many robots have nothing to let go of
        """Let go of the robot; it stands still."""
