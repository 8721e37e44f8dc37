"""What random controllers do: a table of outcomes, and of how far the simulation stretches its own rules.

Quantiles of f and y, successes, divergence, and over all steps the deepest penetration of two bodies and the
fastest joint. `python benchmarks/outcomes.py --setups franka daisy-27d --episodes 1000`
"""

import argparse
import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, repeat

import numpy as np

from workers import setups
from workers.episode import DIVERGED, Episode
from workers.rollout import random_episode
from workers.simulation.bullet import pybullet
from workers.simulation.world import World

MARKS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
CHUNK = 20
_DISTANCE = 8  # in a contact point of PyBullet, in m
_SPEED = 1  # in a joint state


@dataclass(frozen=True)
class Outcome:
    """One episode.

    Attributes:
        f: the objective.
        y: badness.
        stop: why it ended early; "" if it did not.
        finite: whether every number of it is.
        penetration: the deepest of two bodies, in m.
        speed: the fastest of a joint, in rad/s.
    """

    f: float
    y: float
    stop: str
    finite: bool
    penetration: float
    speed: float


class Watch:
    """Looks at all contacts and all joints of a world after each of its steps."""

    def __init__(self) -> None:
        self.penetration = self.speed = 0.0
        self._turning: list[tuple[int, list[int]]] = []

    def look(self, client: int) -> None:
        """Take note of the deepest contact and the fastest joint now."""
        contacts = pybullet.getContactPoints(physicsClientId=client)
        self.penetration = max([self.penetration, *(-contact[_DISTANCE] for contact in contacts)])
        self._turning = self._turning or _turning(client)
        for body, joints in self._turning:
            states = pybullet.getJointStates(body, joints, physicsClientId=client)
            self.speed = max([self.speed, *(abs(state[_SPEED]) for state in states)])


def _turning(client: int) -> list[tuple[int, list[int]]]:
    found = []
    for body in range(pybullet.getNumBodies(physicsClientId=client)):
        count = pybullet.getNumJoints(body, physicsClientId=client)
        infos = [pybullet.getJointInfo(body, joint, physicsClientId=client) for joint in range(count)]
        joints = [info[0] for info in infos if info[2] == pybullet.JOINT_REVOLUTE]
        found += [(body, joints)] if joints else []
    return found


@contextmanager
def watched() -> Iterator[Watch]:
    """Every world that steps inside the block is watched."""
    original, watch = World.step, Watch()

    def step(world: World) -> None:
        original(world)
        watch.look(world.client)

    World.step = step
    try:
        yield watch
    finally:
        World.step = original


def outcomes(name: str, begin: int, seed: int) -> list[Outcome]:
    """Some episodes of a dataset with that seed."""
    setup = setups.load(name)
    found = []
    with setup.open() as environment:
        for index in range(begin, begin + CHUNK):
            with watched() as watch:
                episode = random_episode(setup, environment, seed, index)
            found.append(_outcome(episode, watch))
    return found


def _outcome(episode: Episode, watch: Watch) -> Outcome:
    finite = bool(np.isfinite(episode.xi).all() and np.isfinite([episode.f, episode.y]).all())
    return Outcome(episode.f, episode.y, episode.stop, finite, watch.penetration, watch.speed)


def report(name: str, rows: list[Outcome], thresholds: list[float]) -> None:
    """Print one setup's figures."""
    f, y = np.array([row.f for row in rows]), np.array([row.y for row in rows])
    print(
        f"{name}: {len(rows)} random controllers, {sum(not row.finite for row in rows)} with NaN or infinity,"
    )
    for stop in sorted({row.stop for row in rows} - {""}):
        print(f"  ended as {stop:<14}{np.mean([row.stop == stop for row in rows]):8.3f}")
    print(f"  quantiles {' '.join(f'{mark:g}' for mark in MARKS)}")
    print(f"  f         {' '.join(f'{value:.2f}' for value in np.quantile(f, MARKS))}")
    print(f"  y         {' '.join(f'{value:.3f}' for value in np.quantile(y, MARKS))}, mean {y.mean():.3f}")
    for threshold in [*thresholds, setups.load(name).success]:
        print(f"  share with f > {threshold:<9g}{np.mean(f > threshold):8.3f}")
    whole = [row for row in rows if row.stop != DIVERGED]
    for what, unit, scale in (("penetration", "mm", 1e3), ("speed", "rad/s", 1.0)):
        worst = np.array([getattr(row, what) for row in whole]) * scale
        half, rare, most = np.quantile(worst, (0.5, 0.95, 1.0))
        print(f"  an episode's worst {what}: median {half:.1f}, 95 % {rare:.1f}, largest {most:.1f} {unit}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--setups", nargs="+", default=["franka"])
    parser.add_argument("--episodes", type=int, default=40, help=f"of each setup, in steps of {CHUNK}")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--above", type=float, nargs="*", default=[], help="also count f above these")
    options = parser.parse_args()
    for name in options.setups:
        begins, begin = range(0, options.episodes, CHUNK), time.monotonic()
        with ProcessPoolExecutor(os.cpu_count()) as pool:
            chunks = pool.map(outcomes, repeat(name), begins, repeat(options.seed))
            report(name, list(chain.from_iterable(chunks)), options.above)
        print(f"  in {time.monotonic() - begin:.0f} s at load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
