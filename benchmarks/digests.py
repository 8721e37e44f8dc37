"""SHA-256 of some episodes: equal where seed and index give the same bytes, on any Python and PyBullet.

It needs NumPy, SciPy, jaxtyping and PyBullet alone.
"""

import hashlib
import platform

from workers.rollout import random_episode
from workers.setups import load

EPISODES = {"franka": 3, "yumi": 2, "daisy-11d": 1}


def digest(name: str, episodes: int) -> str:
    setup, found = load(name), hashlib.sha256()
    with setup.open() as environment:
        for index in range(episodes):
            episode = random_episode(setup, environment, 0, index)
            found.update(episode.xi.tobytes() + episode.bad.tobytes())
    return found.hexdigest()


if __name__ == "__main__":
    print(f"Python {platform.python_version()}, {platform.machine()}")
    for name, episodes in EPISODES.items():
        print(f"{name:10} {digest(name, episodes)[:16]}  of {episodes} episodes")
