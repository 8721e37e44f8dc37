"""A robot of a user's own, small and quick: its source, and copies of it with a mistake planted."""

from pathlib import Path

SOURCE = '''\
"""A glider on a line: it is pushed by forces, and by a wind of either sign."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workers.controllers.controller import Controller
from workers.environments.environment import Channel, Environment, Observed
from workers.physics import PhysicsRanges
from workers.setups import Setup
from workers.tasks.task import Task

STEPS = 20
FORCES = tuple(Channel(f"force_{number}", "N", -1.0, 1.0) for number in range(4))
CHANNELS = (Channel("position", "m", -5.0, 5.0), Channel("speed", "m/s", -5.0, 5.0))
PHYSICS = {"mass": (0.5, 2.0), "wind": (-0.2, 0.1)}


class Glider(Environment):
    observation = CHANNELS
    action = (Channel("force", "N", -1.0, 1.0),)
    control_step = 0.1

    def reset(self, physics) -> None:
        self.physics = physics
        self.position, self.speed = 0.0, 0.0

    def step(self, command: Sequence[float]):
        force = command[0] + self.physics["wind"]
        self.speed += 0.1 * force / self.physics["mass"]
        self.position += 0.1 * self.speed
        return self.record()

    def record(self):
        return (self.position, self.speed)

    def observed(self, records) -> Observed:
        return Observed(np.array(records, dtype=np.float32).T, {})

    def close(self) -> None:
        pass


@dataclass(frozen=True)
class Forces(Controller):
    parameters: tuple[Channel, ...] = FORCES

    def start(self, x, environment, horizon):
        values = self.values(x).tolist()
        return lambda step: (values[step * len(values) // horizon],)


class GoRight(Task):
    conditions = ("too_fast",)

    def is_bad(self, observed):
        return np.abs(observed.xi[1:2]) > 0.5

    def objective(self, observed, bad) -> float:
        return float(observed.xi[0, -1])


def setup() -> Setup:
    return Setup(
        name="glider",
        build=Glider,
        controller=Forces(),
        task=GoRight(),
        observation=CHANNELS,
        horizon=STEPS,
        control_step=0.1,
        physics=PhysicsRanges(PHYSICS),
        gaps={level: PhysicsRanges(PHYSICS) for level in ("paper", "training", "wide")},
        objective_limits=(-2.0, 2.0),
        success=0.5,
    )
'''


def write_robot(folder: Path, name: str, *changes: tuple[str, str]) -> Path:
    """Write the robot as a module, with texts of its source replaced; each must be there."""
    source = SOURCE
    for old, new in changes:
        assert source.count(old) >= 1, old
        source = source.replace(old, new, 1)
    path = folder / f"{name}.py"
    path.write_text(source, encoding="utf-8")
    return path
