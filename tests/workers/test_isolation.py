"""Episodes that hang or end their process fail alone, and say of what."""

from dataclasses import replace

import pytest

from workers.attempts import Attempts
from workers.episode import FAILED
from workers.isolation import IsolatedAttempts
from workers.rollout import draw

COUNT = 12


def with_deed(deed: str) -> tuple[tuple[str, str], ...]:
    """The robot does it when a controller pushes hard to the right: one in ten."""
    return (
        ("force = command[0]", "force = (command[0] if command[0] < 0.9 else self.do())"),
        ("    def record(self):", f"    def do(self):\n        {deed}\n\n    def record(self):"),
    )


@pytest.mark.parametrize(
    ("deed", "reason"),
    [
        ("import os; os.abort()", "it ended its process: Fatal Python error: Aborted"),
        ("import os; os._exit(0)", "it ended its process: killed from outside, or by its own exit"),
        (
            "import ctypes; ctypes.string_at(0)",
            "it ended its process: Fatal Python error: Segmentation fault",
        ),
        ("import time; time.sleep(1000)", "it took longer than 2 s"),
        ("raise KeyError('puck')", "KeyError: 'puck', at "),
    ],
    ids=["abort", "exit", "segfault", "hang", "raise"],
)
def test_whatever_an_episode_does_costs_itself(own_robot, deed, reason):
    sound, deadly = own_robot(), own_robot(*with_deed(deed), name="deadly_glider")
    cases = [draw(sound, 0, index) for index in range(COUNT)]
    hard = [bool((sound.controller.values(x) >= 0.9).any()) for x, _ in cases]
    assert 0 < sum(hard) < COUNT
    with Attempts(sound) as attempts, IsolatedAttempts(deadly, timeout=2.0) as isolated:
        expected, found = attempts.rollouts(cases), isolated.rollouts(cases)
    assert [episode.stop == FAILED for episode in found] == hard
    for one, other in zip(expected, found, strict=True):
        if other.failure is None:
            assert (one.xi.tobytes(), one.f) == (other.xi.tobytes(), other.f)
        else:
            assert other.failure.reason.startswith(reason)
    if "sleep" in deed:
        assert "deadly_glider.py" in next(each.failure.text for each in found if each.failure)


def test_a_setup_that_its_name_does_not_give_is_refused(own_robot):
    """The child would roll out another robot than it was given."""
    with pytest.raises(ValueError, match="must give the same setup; they differ in horizon: 30 and 20"):
        IsolatedAttempts(replace(own_robot(), horizon=30))
