"""Fixtures of the comparison tests."""

import pytest


@pytest.fixture
def compared(ray_session, tracking_settings, tmp_path):
    """Runs a small comparison into a folder of the test's own."""
    from cluster.comparison.compare import compare
    from cluster.comparison.plan import Grid, plan_comparison
    from cluster.tracking import open_tracker
    from tests.cluster.comparison.comparing import SETTINGS
    from workers import setups

    def run(
        methods="random,se",
        models=(),
        gap="paper",
        settings=SETTINGS,
        runs=2,
        trials=2,
        folder=tmp_path / "out",
        tracking=tracking_settings,
    ):
        plan = plan_comparison(
            setup=setups.load("franka"),
            grid=Grid(tuple(methods.split(",")), seed=1000, runs=runs),
            trials=trials,
            gap=gap,
            models=models,
            folder=folder,
            settings=settings,
        )
        compare(plan, ray_session, open_tracker(tracking))
        return folder

    return run
