"""An episode is a function of its seed and index: in any order, after others, in any process."""

import hashlib
import json
import subprocess
import sys

import numpy as np
import pytest

from workers.rollout import Episode, random_episode


def _bytes(episode: Episode) -> bytes:
    numbers = np.array([episode.y, episode.f])
    return b"".join(part.tobytes() for part in (episode.x, episode.xi, episode.bad, numbers))


def test_different_controllers_move_differently(episodes):
    assert len({_bytes(episode) for episode in episodes}) == len(episodes)


def test_episodes_are_bit_identical_in_reverse_order_and_after_others(setup, environment, episodes):
    for index in reversed(range(len(episodes))):
        assert _bytes(random_episode(setup, environment, 0, index)) == _bytes(episodes[index])


def test_episodes_are_bit_identical_in_a_fresh_process(setup, episodes):
    script = (
        "import hashlib, json, sys\n"
        "from dataclasses import replace\n"
        "import numpy as np\n"
        "from workers import setups\n"
        "from workers.rollout import random_episode\n"
        "setup = replace(setups.load(sys.argv[1]), horizon=int(sys.argv[2]))\n"
        "with setup.open() as environment:\n"
        "    episodes = [random_episode(setup, environment, 0, index) for index in (4, 1)]\n"
        "digests = [hashlib.sha256(e.xi.tobytes() + e.bad.tobytes()).hexdigest() for e in episodes]\n"
        "print(json.dumps(digests))\n"
    )
    command = [sys.executable, "-c", script, setup.name, str(setup.horizon)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    expected = [
        hashlib.sha256(episodes[index].xi.tobytes() + episodes[index].bad.tobytes()).hexdigest()
        for index in (4, 1)
    ]
    assert json.loads(done.stdout.splitlines()[-1]) == expected


@pytest.mark.slow
def test_thousands_of_shuffled_episodes_leave_nothing_behind(whole, environment):
    """Each of 200 episodes runs ten times in shuffled order, and equals itself in a simulation of its own."""
    expected = {}
    for index in range(200):
        with whole.open() as fresh:
            expected[index] = _bytes(random_episode(whole, fresh, 1, index))
    order = np.tile(np.arange(200), 10)
    np.random.default_rng(0).shuffle(order)
    for index in order.tolist():
        assert _bytes(random_episode(whole, environment, 1, index)) == expected[index], index
