"""Ray Tune says nothing of its own."""

import logging
import os

import pytest

from cluster.runtime.tune import silence_tune


@pytest.fixture
def environment(monkeypatch):
    """The environment as it was, afterwards."""
    monkeypatch.setattr(os, "environ", os.environ.copy())
    yield
    logging.getLogger("ray.tune").setLevel(logging.NOTSET)


@pytest.mark.usefixtures("environment")
def test_ctrl_c_and_output_are_taken_from_tune():
    silence_tune()
    assert os.environ["TUNE_DISABLE_SIGINT_HANDLER"] == "1"
    assert os.environ["TUNE_DISABLE_AUTO_CALLBACK_LOGGERS"] == "1"
    assert not logging.getLogger("ray.tune").isEnabledFor(logging.ERROR)
