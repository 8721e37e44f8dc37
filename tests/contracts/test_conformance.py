"""Every setup that ships, and the example of a user's own, passes what `svaedc check` asks of any robot."""

import pytest

from tests.contracts.conftest import each_setup
from workers.conformance.remark import Severity
from workers.conformance.sample import FEWEST, sample
from workers.conformance.suite import CHECKS, find

FAST = ("franka", "yumi-mujoco", "two_link_pusher", "cart_pole")


@pytest.fixture(scope="module")
def looked_at(whole):
    with sample(whole, seed=0, timeout=60.0, time_limit=1.0) as taken:
        yield taken


@pytest.mark.parametrize("whole", each_setup(lambda name: name in FAST), indirect=True, scope="module")
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.name)
def test_no_check_finds_a_mistake(check, looked_at):
    assert len(looked_at.episodes) >= FEWEST
    found = [finding for finding in find(check, looked_at) if finding.severity is Severity.MISTAKE]
    assert found == []
