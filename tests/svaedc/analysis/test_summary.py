"""What may be asked of a report."""

import pytest

from svaedc.analysis.summary import Reporting


def test_meaningless_reporting_is_refused():
    with pytest.raises(ValueError, match=r"confidence must lie between 0 and 1, got 90\.0"):
        Reporting(confidence=90.0)
    with pytest.raises(ValueError, match="initial must be at least 0, got -1"):
        Reporting(initial=-1)
