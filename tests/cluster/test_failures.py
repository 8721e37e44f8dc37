"""What a person reads of a failed episode fits a screen, and can be pasted into a terminal."""

import shlex

from cluster.failures import failure_text
from workers.episode import Failure

FAILURE = Failure(
    "KeyError: 'puck', at arm.py:12 in step: masses['puck']", "Traceback ...\nKeyError: 'puck'\n"
)


def test_it_names_episode_setup_reason_and_the_command_that_shows_it_again():
    told = failure_text("episode 12 of seed 3", "arm", "gentle:reach", [0.25, 1.0], {"mass": 0.1}, FAILURE)
    assert told.startswith("episode 12 of seed 3 of arm failed: KeyError: 'puck', at arm.py:12 in step:")
    assert "G_bad: gentle:reach" in told
    assert told.endswith("KeyError: 'puck'\n")
    command = shlex.split(next(line for line in told.splitlines() if "svaedc render" in line))
    assert command[2:] == ["--setup", "arm", "--x", "0.25,1", "--physics", "mass=0.1", "--out", "again.gif"]


def test_a_setup_without_physics_has_none_in_its_command():
    assert "--physics" not in failure_text("episode 0 of seed 0", "formula", "", [0.5], {}, FAILURE)
