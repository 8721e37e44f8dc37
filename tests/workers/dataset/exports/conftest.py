"""What exports are compared with."""

import pytest


@pytest.fixture
def rows(dataset):
    """All episodes of the dataset, read by its own reader."""
    return [columns for _, columns in dataset.batches()]
