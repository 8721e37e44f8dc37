"""What MLflow remembers of a command: one run per driver, child runs beneath it; written by the driver alone.

This package is the only code that knows MLflow. It uses the client with an explicit store instead of MLflow's
global state, so two trackers never disturb each other, and it turns a failing store into one message.
"""

import os

# Read while MLflow is imported, so it comes first: nothing here reports home.
os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")

from cluster.tracking.models import log_model
from cluster.tracking.runs import UI_PORT, Run, Tracker
from cluster.tracking.store import open_tracker

__all__ = ["UI_PORT", "Run", "Tracker", "log_model", "open_tracker"]
