"""The paper's hexapod: eighteen HEBI modules, told an angle each, sixty times a second.

It runs where `pip install hebi-py jaxtyping` was done (Python 3.10 to 3.12, NumPy below 2), and realises the
setup `daisy-11d`. The robot does not see how far it walks: `measure` tells it, or a person does afterwards.
"""

import hashlib
import importlib
from collections.abc import Sequence
from typing import Any, ClassVar

import hebi
import numpy as np

from workers.controllers.cpg import ELBOW_CENTER, cpg_11d
from workers.host.limits import HostChannel
from workers.host.machine import Fault, Plan, Rest, RobotMachine
from workers.host.recording import write_table

PERIOD, STEPS = 1 / 60, 1500  # s; of the gait, 25 s (section 6 of the paper)
REACH = (0.6, 1.0, 1.5)  # rad of base, shoulder and elbow (section 6)
FAST = 10.0  # rad/s: each step with a faster joint costs 1
RAMP = 120  # steps from the stance to the gait's first command
STANCE = np.array(3 * (0.0, 0.0, ELBOW_CENTER, 0.0, 0.0, -ELBOW_CENTER))  # rad, a left leg and a right one
NEAR = 0.2  # rad, as far as a joint may be from the stance before a trial
LIFETIME = 100.0  # ms: modules that hear nothing for so long let go
LISTEN_SECONDS = 2.0


class HebiHexapod(RobotMachine):
    """Eighteen modules in the order of the setup's joints: legs LF RF LM RM LB RB; base, shoulder, elbow.

    Args:
        names: of the modules, in that order; none for the maker's imitation, which moves nothing.
        family: of the modules.
        steps: of the gait.
        measure: `module:function` that returns the metres walked towards +y; "" where a person measures.
        hottest: winding temperature in °C above which a trial ends.
    """

    rest: ClassVar[Rest] = Rest(stop="sag", kill="sag", silence="sag", disconnect="sag")
    period = PERIOD

    def __init__(
        self,
        names: Sequence[str] = (),
        family: str = "Daisy",
        steps: int = STEPS,
        measure: str = "",
        hottest: float = 80.0,
    ) -> None:
        self._controller = cpg_11d(REACH)
        self.channels = tuple(HostChannel(each.name, "position", "rad") for each in self._controller.planned)
        self._group = _modules(names, family) if names else hebi.util.create_imitation_group(18)
        self._group.command_lifetime = LIFETIME
        self._command, self._feedback = hebi.GroupCommand(18), hebi.GroupFeedback(18)
        self._steps, self._measure, self._hottest = steps, measure, hottest
        self._seen: list[list[float]] = []
        if not names:
            self.send(STANCE.tolist())

    def plan(self, x: Sequence[float]) -> Plan:
        """From the stance into the gait; see `RobotMachine.plan`."""
        gait = self._controller.commands(np.array(x, np.float32), self._steps)
        ramp = STANCE + np.linspace(0, 1, RAMP)[:, None] * (gait[0] - STANCE)
        rows = np.concatenate([ramp, gait]).tolist()
        return Plan(self.channels, PERIOD, rows, PERIOD * len(rows))

    def begin(self, x: Sequence[float]) -> None:
        """Look whether it stands as it should; see `RobotMachine.begin`.

        Raises:
            Fault: it does not.
        """
        away = np.abs(self._look()[:18] - STANCE)
        if not away.max() < NEAR:
            name = self.channels[int(np.argmax(away))].name
            raise Fault(f"joint {name} is {away.max():.2f} rad away from the stance: put the robot into it")
        self._rows, self._seen = self.plan(x).rows, []

    def command(self, step: int) -> Sequence[float] | None:
        """See `RobotMachine.command`."""
        return self._rows[step] if step < len(self._rows) else None

    def send(self, command: Sequence[float]) -> None:
        """See `RobotMachine.send`.

        Raises:
            Fault: a winding is too hot.
        """
        self._command.position = np.array(command)
        if not self._group.send_command(self._command):
            raise RuntimeError("the modules took no command")
        self._seen.append(self._look().tolist())
        if max(self._seen[-1][36:]) > self._hottest:
            raise Fault(f"a winding has {max(self._seen[-1][36:]):.0f} °C, more than {self._hottest:.0f}")

    def stop(self) -> None:
        """Send nothing: modules that hear nothing for their lifetime let go."""

    def end(self) -> dict[str, Any]:
        """See `RobotMachine.end`.

        Raises:
            RuntimeError: nobody measured how far it walked.
        """
        seen = np.array(self._seen)
        fast = int((np.abs(np.nan_to_num(seen[:, 18:36])).max(axis=1) > FAST).sum())
        if self.folder is not None:
            names = [f"{each.name}_{what}" for what in ("rad", "rad/s", "°C") for each in self.channels]
            write_table(self.folder / "feedback.csv", names, self._seen)
        y = fast / len(seen)
        if not self._measure:
            raise RuntimeError(
                f"measure how far it walked, and resolve the trial as measured: f = 10 x metres - {fast}, "
                f"y = {y:.3f} or more"
            )
        module, _, function = self._measure.partition(":")
        metres = float(getattr(importlib.import_module(module), function)())
        return {
            "f": 10.0 * metres - fast,
            "y": y,
            "stop": "",
            "evidence": hashlib.sha256(seen.tobytes()).hexdigest(),
        }

    def _look(self) -> np.ndarray:
        """Positions, speeds and temperatures of all modules, [54]."""
        if self._group.get_next_feedback(reuse_fbk=self._feedback) is None:
            raise RuntimeError("the modules do not answer")
        found = self._feedback
        return np.concatenate([found.position, found.velocity, found.motor_winding_temperature])


def _modules(names: Sequence[str], family: str) -> Any:
    lookup = hebi.Lookup()
    group = lookup.get_group_from_names([family], list(names), timeout_ms=1e3 * LISTEN_SECONDS)
    if group is None:
        known = sorted(f"{each.family}/{each.name}" for each in lookup.entrylist)
        raise ConnectionError(
            f"of the modules {', '.join(names)} of {family} some do not answer; there are: "
            f"{', '.join(known) or 'none'}"
        )
    return group
