"""The rehearsal robot: a simulated setup with hidden physics that stands in for the real one."""

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, ClassVar, Final

import numpy as np

from workers import setups
from workers.controllers.controller import PlanTimes
from workers.environments.environment import Channel
from workers.hardware.robots import GAP
from workers.host.limits import HostChannel
from workers.host.machine import Fault, Plan, Rest, RobotMachine
from workers.host.recording import write_table
from workers.randomness import Stream, generator
from workers.rollout import Steps
from workers.user_code import describe

_KINDS: Final = {"rad": "position", "rad/s": "speed", "N·m": "torque", "m": "workspace"}


class RehearsalMachine(RobotMachine):
    """A setup whose physics is drawn once from the wide gap and never shown to the campaign.

    Args:
        setup: name of the setup that models and methods know.
        simulated: name of the one that moves; it may be another, which stands in for it.
        seed: of the campaign; the hidden physics follows from it alone.
    """

    rest: ClassVar[Rest] = Rest(stop="hold", kill="hold", silence="hold", disconnect="hold")

    def __init__(self, setup: str, simulated: str, seed: int) -> None:
        self._setup = replace(setups.load(simulated), name=setup)
        self._environment = self._setup.open()
        self._physics = self._setup.gap(GAP).draw(generator(seed, Stream.HIDDEN_PHYSICS, 0))
        self._steps: Steps | None = None
        self.period = self._setup.control_step
        self.channels = tuple(map(_host_channel, self._environment.action))

    def plan(self, x: Sequence[float]) -> Plan:
        """What the controller wants, as far as its kind can tell it; see `RobotMachine.plan`.

        Args:
            x: the controller, each parameter in [0, 1].

        Returns:
            One row for every step; none where the controller offers no plan.
        """
        channels, period = self._setup.controller.planned, self._setup.control_step
        seconds = self._setup.horizon * period
        if not channels:
            return Plan((), period, (), seconds)
        steps = np.arange(1, self._setup.horizon + 1)
        times = PlanTimes(steps, self._setup.horizon, period)
        [rows] = self._setup.controller.plans(np.array([x], np.float32), times)
        return Plan(tuple(map(_host_channel, channels)), period, rows.T.tolist(), seconds)

    def begin(self, x: Sequence[float]) -> None:
        """Reset the simulation; see `RobotMachine.begin`.

        Raises:
            Fault: the code of the setup failed.
        """
        with _faults():
            self._steps = Steps(self._setup, self._environment, np.array(x, np.float32), self._physics)

    def command(self, step: int) -> list[float] | None:
        """See `RobotMachine.command`."""
        del step  # the episode counts its own
        with _faults():
            command = self._current().command()
            return None if command is None else [float(value) for value in command]

    def send(self, command: Sequence[float]) -> None:
        """One step of the simulation; see `RobotMachine.send`."""
        with _faults():
            self._current().apply(command)

    def stop(self) -> None:
        """Nothing moves between two steps."""

    def end(self) -> dict[str, Any]:
        """See `RobotMachine.end`."""
        with _faults():
            episode = self._current().episode()
        if not np.isfinite(episode.f):
            raise Fault("the simulation exploded")
        if self.folder is not None:
            # As text, from which the same numbers are read: the host's own files have this form too.
            names = [channel.name for channel in self._setup.observation]
            write_table(self.folder / "trajectory.csv", names, episode.xi.T.tolist())
        return {
            "f": float(episode.f),
            "y": float(episode.y),
            "stop": episode.stop,
            "evidence": hashlib.sha256(episode.xi.tobytes()).hexdigest(),
        }

    def close(self) -> None:
        """End the simulation."""
        self._environment.close()

    def _current(self) -> Steps:
        if self._steps is None:
            raise Fault("no controller was begun")
        return self._steps


@contextmanager
def _faults() -> Iterator[None]:
    """A setup's code that fails is a fault: a simulation that broke off stands still."""
    try:
        yield
    except Fault:
        raise
    except Exception as error:
        raise Fault(describe(error)) from error


def _host_channel(channel: Channel) -> HostChannel:
    return HostChannel(channel.name, _KINDS.get(channel.unit, ""), channel.unit)
