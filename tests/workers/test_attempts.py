"""Episodes whose code raises cost themselves: the next goes on, in an environment opened anew."""

import subprocess
import sys

import numpy as np
import pytest

from workers.attempts import Attempts
from workers.episode import FAILED
from workers.rollout import draw, rollout

RAISES = ("force = command[0]", "force = {True: command[0]}[command[0] < 0.9]")
"""For one in ten of all controllers, a dictionary has no such key."""


HANGS = (
    ("force = command[0]", "force = self.wait()"),
    (
        "    def record(self):",
        "    def wait(self):\n        import time\n        time.sleep(100)\n\n    def record(self):",
    ),
)


def require_timeout(code: str, file: str, folder) -> None:
    """Run code in a process of its own: it must end by a timeout whose traceback names the file."""
    ended = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={"PYTHONPATH": ":".join(sys.path)},
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=60,
    )
    assert ended.returncode == 1
    assert "Timeout" in ended.stderr
    assert file in ended.stderr


def cases(setup, count: int = 40):
    return [draw(setup, 0, index) for index in range(count)]


def test_what_raises_fails_alone_and_the_others_are_as_without_it(own_robot):
    sound, moody = own_robot(), own_robot(RAISES, name="moody_glider")
    with Attempts(sound) as attempts:
        expected = attempts.rollouts(cases(sound))
    with Attempts(moody) as attempts:
        found = attempts.rollouts(cases(moody))
    failed = [episode.stop == FAILED for episode in found]
    assert 0 < sum(failed) < len(failed)
    assert failed == [bool((sound.controller.values(x) >= 0.9).any()) for x, _ in cases(sound)]
    for one, other, is_failed in zip(expected, found, failed, strict=True):
        if is_failed:
            assert "KeyError: False, at " in other.failure.reason
            assert "moody_glider.py:" in other.failure.reason
            assert "Traceback" in other.failure.text
            assert (other.y, other.f, other.x.tobytes()) == (1.0, -2.0, one.x.tobytes())
        else:
            assert other.failure is None
            assert other.xi.tobytes() == one.xi.tobytes()


def test_an_episode_is_tried_once_more_where_an_earlier_one_may_be_to_blame(own_robot):
    setup = own_robot(
        ("self.position, self.speed = 0.0, 0.0", "self.position, self.speed = 0.0, 0.0\n        self.use()"),
        (
            "    def record(self):",
            "    uses = 0\n\n    def use(self):\n        self.uses += 1\n        assert self.uses < 3\n\n"
            "    def record(self):",
        ),
    )
    with Attempts(setup) as attempts:
        assert {episode.stop for episode in attempts.rollouts(cases(setup, 10))} == {""}


@pytest.mark.parametrize("error", ["OSError(28, 'no space')", "MemoryError()"])
def test_troubles_of_the_machine_are_no_fault_of_an_episode(own_robot, error):
    setup = own_robot(
        ("force = command[0]", "force = self.fail()"),
        ("    def record(self):", f"    def fail(self):\n        raise {error}\n\n    def record(self):"),
    )
    with Attempts(setup) as attempts, pytest.raises((OSError, MemoryError)):
        attempts.rollouts(cases(setup, 1))


def test_no_controller_of_the_setup_is_a_mistake_of_the_caller(own_robot):
    setup = own_robot()
    with Attempts(setup) as attempts, pytest.raises(ValueError, match=r"x must have shape \(4,\)"):
        attempts.rollout(np.zeros(3), {"mass": 1.0, "wind": 0.0})


def test_an_exit_in_a_users_code_is_an_error_as_any_other(own_robot):
    setup = own_robot(("force = command[0]", "force = exit(3)"))
    with Attempts(setup) as attempts:
        assert attempts.rollout(*cases(setup, 1)[0]).failure.reason.startswith("SystemExit: 3, at ")


def test_what_hangs_ends_its_process_and_its_traceback_is_told(own_robot, tmp_path):
    own_robot(
        *HANGS,
        name="slow_glider",
    )
    code = (
        "from workers import setups\nfrom workers.attempts import Attempts\n"
        "from workers.rollout import draw\n"
        "setup = setups.load('slow_glider')\n"
        "Attempts(setup, timeout=0.5).rollout(*draw(setup, 0, 0))\n"
    )
    require_timeout(code, "slow_glider.py", tmp_path)


def test_a_pause_between_episodes_is_no_hang(own_robot):
    import time

    setup = own_robot()
    with Attempts(setup, timeout=0.2) as attempts:
        first = attempts.rollout(*cases(setup, 1)[0])
        time.sleep(0.6)
        again = attempts.rollout(*cases(setup, 1)[0])
    assert first.xi.tobytes() == again.xi.tobytes()


def test_a_sound_episode_is_what_the_control_loop_gives(own_robot):
    setup = own_robot()
    with setup.open() as environment, Attempts(setup) as attempts:
        for x, physics in cases(setup, 3):
            assert (
                attempts.rollout(x, physics).xi.tobytes()
                == rollout(setup, environment, x, physics).xi.tobytes()
            )


def test_a_try_out_that_hangs_ends_its_process_and_shows_where(own_robot, tmp_path):
    own_robot(
        *HANGS,
        name="stuck_glider",
    )
    code = (
        "from workers import attempts, setups\nfrom workers.collection import shard\n"
        "shard.Watchdog = lambda: attempts.Watchdog(0.5)\n"
        "shard.require_working(setups.load('stuck_glider'), 0)\n"
    )
    require_timeout(code, "stuck_glider.py", tmp_path)
