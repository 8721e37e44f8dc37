"""What a cluster without the dashboard does without: Ray's processes cost CPU time for as long as they live.

All of it is there to be looked at in the dashboard, or to print at this terminal what workers print, which no
command asks for. Workers that die are noticed, and memory is watched over, by the raylet and the head alone.
`docs/benchmarks.md` says what each entry saves.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from ray._private import worker

SETTINGS: Mapping[str, Any] = {
    # Counters that every process exports every ten seconds, for the dashboard and Prometheus.
    "enable_metrics_collection": False,
}
"""Of all of Ray's processes. The user's own, RAY_<name> in the environment, come first."""

AGENT: Mapping[str, str] = {
    # The agent, without which no raylet lives, looks at every process so often; by default every 5 s.
    "REPORTER_UPDATE_INTERVAL_MS": "3600000",
}
"""Of the agent, which knows them by its environment only."""


def settings() -> dict[str, Any]:
    """Settings that Ray is to be started with, but for those that the user has chosen."""
    return {name: value for name, value in SETTINGS.items() if f"RAY_{name}" not in os.environ}


@contextmanager
def quiet_agent() -> Iterator[None]:
    """Let the agent that is started within this block inherit its settings; later clusters do not."""
    ours = {name: value for name, value in AGENT.items() if name not in os.environ}
    os.environ.update(ours)
    try:
        yield
    finally:
        for name in ours:
            os.environ.pop(name, None)


def end_spectators() -> None:
    """End the processes of the cluster just started that only watch; `ray.init` starts them regardless.

    They are the log monitor, which searches the workers' logs ten times a second for a driver that prints
    them, and what remains of the dashboard, which reports its own load. The logs are written without them.
    """
    node = worker._global_node
    if node is not None:
        node.kill_log_monitor(check_alive=False)
        node.kill_dashboard(check_alive=False)
