"""What MLflow remembers of a command: one run per driver, child runs beneath it; written by the driver alone.

This package is the only code that knows MLflow. It uses the client with an explicit store instead of MLflow's
global state, so two trackers never disturb each other, and it turns a failing store into one message.
"""

import os

from cluster.home import require_home

# Both are read while MLflow is imported, so they come first: nothing here reports home, and there is one.
os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
require_home()

from cluster.tracking.models import log_model  # noqa: E402
from cluster.tracking.runs import UI_PORT, Run, Tracker  # noqa: E402
from cluster.tracking.store import open_tracker  # noqa: E402

__all__ = ["UI_PORT", "Run", "Tracker", "log_model", "open_tracker"]
