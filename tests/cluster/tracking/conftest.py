"""One MLflow store for all tests of tracking."""

import pytest


@pytest.fixture(scope="session")
def settings(tmp_path_factory):
    from cluster.config import TrackingSettings

    folder = tmp_path_factory.mktemp("tracking")
    return TrackingSettings(uri=f"sqlite:///{folder}/store/mlflow.db", experiment="tests")


@pytest.fixture(scope="session")
def tracker(settings):
    from cluster.tracking import open_tracker

    return open_tracker(settings)
