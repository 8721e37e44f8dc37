"""Fixtures of the training tests: a way to train in seconds, and trainings done once for all tests."""

import shutil
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def cache(tmp_path_factory) -> Path:
    """One for all tests: the dataset is decoded once."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def run_train(ray_session, tracking_settings, franka_dataset, tmp_path, cache):
    """Trains into a folder of the test's own."""
    from cluster.tracking import open_tracker
    from cluster.training.train import train
    from tests.cluster.training.small import settings

    def run(name: str = "model", preset: str = "compact", folder: Path = franka_dataset, **changes) -> Path:
        return train(
            folder=folder,
            model=tmp_path / name,
            preset=preset,
            seed=0,
            settings=settings(changes.pop("cache", cache), **changes),
            session=ray_session,
            tracker=open_tracker(tracking_settings),
        )

    return run


@pytest.fixture(scope="session")
def ends(ray_session, franka_dataset, tmp_path_factory, cache) -> dict[str, Path]:
    """Folders of a finished training and of one that its time limit ended half-way."""
    from cluster.config import TrackingSettings
    from cluster.tracking import open_tracker
    from cluster.training.train import train
    from tests.cluster.training.small import settings

    folder = tmp_path_factory.mktemp("ends")
    limits = {"finished": float("inf"), "half-way": 1e-6}
    for name, limit in limits.items():
        train(
            folder=franka_dataset,
            model=folder / name,
            preset="compact",
            seed=0,
            settings=settings(cache, time_limit_seconds=limit),
            session=ray_session,
            tracker=open_tracker(TrackingSettings(uri=f"sqlite:///{folder}/mlflow.db")),
        )
    return {name: folder / name for name in limits}


@pytest.fixture
def finished(ends, tmp_path) -> Path:
    """The checkpoint of a finished training, in the folder that `run_train` uses."""
    return shutil.copytree(ends["finished"], tmp_path / "model") / "model.pt"


@pytest.fixture
def half_way(ends, tmp_path) -> Path:
    """The checkpoint of a training that goes on, in the folder that `run_train` uses."""
    return shutil.copytree(ends["half-way"], tmp_path / "model") / "model.pt"
