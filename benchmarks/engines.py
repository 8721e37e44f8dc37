"""MuJoCo beside PyBullet: CPU of the same episodes, interleaved controller by controller in one process.

Prints for each robot the CPU time of an episode in both engines, their ratio, and the steps of the engine per
CPU second in MuJoCo; `--count N` runs more controllers. The first episode of each is not counted.
"""

import argparse
import time

from workers import setups
from workers.environments.daisy import SUBSTEPS
from workers.rollout import draw, rollout

ROBOTS = {"franka": 1, "yumi": 1, "daisy-27d": SUBSTEPS, "daisy-11d": SUBSTEPS}
SEED = 13


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    count = parser.parse_args().count
    for name, substeps in ROBOTS.items():
        pair = [setups.load(name), setups.load(f"{name}-mujoco")]
        seconds = [0.0, 0.0]
        with pair[0].open() as bullet, pair[1].open() as mujoco:
            for index in range(count + 1):
                for side, environment in enumerate((bullet, mujoco)):
                    case = draw(pair[side], SEED, index)
                    begin = time.process_time()
                    rollout(pair[side], environment, *case)
                    seconds[side] += time.process_time() - begin if index else 0.0
        one, other = (1e3 * each / count for each in seconds)
        rate = pair[1].horizon * substeps * count / seconds[1]
        print(
            f"{name:10} {one:6.1f} ms in PyBullet, {other:6.1f} ms in MuJoCo: "
            f"{one / other:.2f} times as fast, {rate:,.0f} steps/s",
            flush=True,
        )


if __name__ == "__main__":
    main()
