"""The rehearsal robot: a simulated setup with hidden physics that stands in for the real one."""

import hashlib
import threading
import time
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workers.attempts import Attempts
from workers.controllers.controller import unit_cube
from workers.hardware import ledger
from workers.hardware.driver import Measurement, Motion, RobotFault
from workers.hardware.ledger import MotionLedger
from workers.randomness import Stream, generator
from workers.setups import Setup

GAP = "wide"
"""The hidden physics is drawn from this one of the setup's gaps."""
LONGEST_PACE_SECONDS = 86_400.0
"""The pace is at most a day, for a clock cannot wait for just any number."""


class RehearsalRobot:
    """A setup whose physics is drawn once from the wide gap and never shown to the campaign.

    Args:
        name: of the robot, as in the registry.
        setup: what is simulated.
        seed: of the campaign; the hidden physics follows from it alone.
        pace: least duration of a trial in s, at most a day; 0 runs as fast as the simulation.
        folder: where the ledger of physical starts lies.

    Raises:
        ValueError: when pace is negative, longer than a day, or no number.
    """

    def __init__(self, name: str, setup: Setup, seed: int, pace: float, folder: Path) -> None:
        if not 0.0 <= pace <= LONGEST_PACE_SECONDS:
            raise ValueError(f"pace must lie in [0, {LONGEST_PACE_SECONDS:.0f}] s, got {pace}")
        self.name = name
        self.setup = setup.name
        self._simulated = setup
        self._physics = setup.gap(GAP).draw(generator(seed, Stream.HIDDEN_PHYSICS, 0))
        self._pace = pace
        self._ledger = MotionLedger(folder / ledger.FILE)
        self._stopped = threading.Event()

    def run(self, trial_id: str, x: Float[np.ndarray, " D"]) -> Measurement:
        """Rolls x out once under the hidden physics; see `RobotDriver.run`.

        Args:
            trial_id: never seen by this robot before.
            x: the controller, [D], in [0, 1].

        Returns:
            What the episode was worth, and how long it took with the pace.

        Raises:
            RobotFault: it was stopped, before the trial or during it, or the simulation's code raised.
        """
        began = time.monotonic()
        if self._stopped.is_set():
            raise RobotFault(f"trial {trial_id} was not started: the robot has been stopped")
        controller = unit_cube(x.astype(np.float32), self._simulated.dimensions)
        self._ledger.start(trial_id, x)
        with Attempts(self._simulated) as attempts:
            episode = attempts.rollout(controller, self._physics)
        if episode.failure is not None:
            raise RobotFault(f"trial {trial_id} failed: {episode.failure.reason}")
        if self._stopped.wait(max(0.0, self._pace - (time.monotonic() - began))):
            raise RobotFault(f"trial {trial_id} was stopped before its end")
        evidence = hashlib.sha256(episode.xi.tobytes()).hexdigest()
        seconds = time.monotonic() - began
        measurement = Measurement(float(episode.f), float(episode.y), episode.stop, seconds, evidence)
        self._ledger.end(trial_id, measurement)
        return measurement

    def stop(self) -> None:
        """Ends the trial under way as a fault, and every later one before it starts."""
        self._stopped.set()

    def motion(self, trial_id: str) -> Motion:
        """What the ledger of physical starts says of a trial."""
        return self._ledger.motion(trial_id)
