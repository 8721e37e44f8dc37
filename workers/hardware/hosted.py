"""A robot behind its host: a child process that is asked for one motion at a time, and the robot's ledger."""

import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from jaxtyping import Float

from workers.hardware.driver import Measurement, Motion, RobotBroke, RobotFault, RobotStopped
from workers.hardware.host_process import HostProcess, Machinery
from workers.hardware.records import measurement_of, motion_in
from workers.host import protocol
from workers.host.guard import SILENCE_SECONDS
from workers.host.home import RobotHome
from workers.host.limits import RobotLimits

_SLACK: Final = 2.0
_SIMULATED_SLACK: Final = 120.0
_PATIENCE_SECONDS: Final = 30.0  # beyond the deadline of a trial, at which a host that lives answers
_SIMULATED_SILENCE: Final = 15.0  # s: a simulation that fills a busy machine is not stopped for it


@dataclass(frozen=True)
class Planned:
    """What a controller will ask of the robot.

    Attributes:
        seconds: duration of the motion.
        steps: rows of the plan; 0 where the robot offers none.
        channels: name, kind, unit, lowest and highest value of each.
        objection: why it must not run; "" when it may.
    """

    seconds: float
    steps: int
    channels: tuple[Mapping[str, Any], ...]
    objection: str


class HostedRobot:
    """A robot that one process at a time drives; the host starts with the first question to it.

    Args:
        name: of the robot, as in the registry.
        setup: name of the setup it realises.
        home: of the robot, which the caller holds.
        machinery: how its host is started.
        limits: of the robot.
        period: s between two commands; None for the robot's own.
    """

    def __init__(
        self,
        name: str,
        setup: str,
        home: RobotHome,
        machinery: Machinery,
        limits: RobotLimits,
        period: float | None = None,
    ) -> None:
        self.name = name
        self.setup = setup
        self.home = home
        self._machinery = machinery
        self._limits = limits
        self._period = period
        self._host: HostProcess | None = None
        self._planned: dict[str, tuple[bytes, Planned]] = {}

    @property
    def hello(self) -> Mapping[str, Any]:
        """What the host says of itself: rest, period, channels.

        Raises:
            RobotFault: it does not start.
        """
        return self._process().hello

    def check(self, trial_id: str, x: Float[np.ndarray, " D"]) -> Planned:
        """What a controller will ask of the robot; nothing moves.

        Args:
            trial_id: of the trial.
            x: the controller, [D], in [0, 1].

        Returns:
            The plan's extremes, or why it must not run.

        Raises:
            RobotFault: the host does not start, or does not answer.
        """
        known = self._planned.get(trial_id)
        if known is not None and known[0] == x.tobytes():
            return known[1]
        answer = self._ask({"do": "plan", "trial": trial_id, "x": protocol.encode(x.tolist())})
        if answer["say"] != "planned":
            raise RobotFault(f"the plan of {trial_id} could not be made: {answer.get('reason')}")
        planned = Planned(
            answer["seconds"], answer["steps"], tuple(answer["channels"]), str(answer["objection"])
        )
        self._planned = {trial_id: (x.tobytes(), planned)}  # the host looks at it once more before it moves
        return planned

    def run(self, trial_id: str, x: Float[np.ndarray, " D"]) -> Measurement:
        """Move the robot once; see `RobotDriver.run`.

        Args:
            trial_id: never seen by this robot before.
            x: the controller, [D], in [0, 1].

        Returns:
            What the trial measured.

        Raises:
            RobotFault: the robot broke off and stands still, or nothing moved.
            RobotStopped: the motion was stopped; the robot is at rest.
            RobotBroke: nobody knows what the robot did.
        """
        planned = self.check(trial_id, x)
        if planned.objection:
            raise RobotFault(f"trial {trial_id} was not started: {planned.objection}")
        began = time.monotonic()
        seconds = self._longest(planned)
        answer = self._ask(
            {"do": "run", "trial": trial_id, "x": protocol.encode(x.tolist()), "seconds": seconds}, trial_id
        )
        if answer["say"] == "ended":
            return measurement_of(answer["measurement"], time.monotonic() - began)
        self.stop()  # whatever a host has gone through, the next trial gets a new one
        raise _ERRORS[answer["say"]](f"trial {trial_id}: {answer.get('reason')}")

    def stop(self) -> None:
        """End the host, which brings the robot to rest."""
        if self._host is not None:
            self._host.leave()
        self._host = None

    def motion(self, trial_id: str) -> Motion:
        """What the robot's ledger says of a trial."""
        return motion_in(self.home.ledger, trial_id)

    def _longest(self, planned: Planned) -> float:
        """The deadline of a trial, in s from its start."""
        own = float(self.hello["period"])
        stretched = planned.seconds * (self._period / own) if self._period else planned.seconds
        slack = _SIMULATED_SLACK if self._machinery.simulated else _SLACK
        return 1.2 * max(planned.seconds, stretched) + slack

    def _ask(self, message: Mapping[str, Any], trial_id: str = "") -> Mapping[str, Any]:
        """The host's answer; signs of life go to it until it has come."""
        started = self._process()
        patience = float(message.get("seconds", 0.0)) + _PATIENCE_SECONDS
        try:
            with started.beating():
                started.tell(message)
                while (answer := started.listen(patience))["say"] in ("started", "hello"):
                    pass
                return answer
        except (OSError, EOFError, ValueError) as error:
            self.stop()
            raise self._loss(started, trial_id, error) from error

    def _process(self) -> "HostProcess":
        if self._host is None:
            limits, period = self._limits.facts(), self._period
            usual = _SIMULATED_SILENCE if self._machinery.simulated else SILENCE_SECONDS
            silence = self._limits.silence or usual
            settings = {"machine": dict(self._machinery.settings), "limits": limits, "silence": silence}
            if self._machinery.python == sys.executable:
                settings["path"] = [entry for entry in sys.path if entry]  # users' modules are found there
            self._host = HostProcess(
                self.home, self._machinery, settings if period is None else {**settings, "period": period}
            )
        return self._host

    def _loss(self, lost: "HostProcess", trial_id: str, error: Exception) -> RobotFault:
        """What is known once the host is gone: a trial it was running is unknown."""
        kill = lost.hello.get("rest", {}).get("kill", "what nobody declared")
        what = f"the process at {self.name} is gone ({lost.end}; {error}), see {self.home.log}"
        if trial_id and self.motion(trial_id).started:
            return RobotBroke(f"trial {trial_id}: {what}; without it its motors {kill}")
        return RobotFault(f"{what}; nothing was moved")


_ERRORS: Final[Mapping[str, type[RobotFault]]] = {
    "fault": RobotFault,
    "stopped": RobotStopped,
    "refused": RobotStopped,
    "broke": RobotBroke,
}
