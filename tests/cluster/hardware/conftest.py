"""Fixtures of the hardware tests."""

import multiprocessing

import pytest


@pytest.fixture(scope="session")
def processes():
    """Real processes that start in milliseconds: forked from a server that has imported everything."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.cluster.hardware.desk"])
    return context
