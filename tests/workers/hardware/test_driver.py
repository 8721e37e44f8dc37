"""What a robot may say of a trial."""

import pytest

from workers.hardware.driver import Measurement

EVIDENCE = "ab" * 32


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("f", float("nan"), "objective f must be finite, got nan"),
        ("y", 1.5, r"badness y must lie in \[0, 1\], got 1.5"),
        ("y", float("nan"), r"badness y must lie in \[0, 1\], got nan"),
        ("seconds", -1.0, "seconds must be finite and at least 0, got -1.0"),
        ("evidence", "abc", "evidence must be a SHA-256 in hexadecimal, got 'abc'"),
    ],
)
def test_an_impossible_measurement_is_refused(field, value, message):
    good = {"f": 0.5, "y": 0.25, "stop": "", "seconds": 1.0, "evidence": EVIDENCE}
    with pytest.raises(ValueError, match=message):
        Measurement(**(good | {field: value}))
