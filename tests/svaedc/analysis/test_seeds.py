import pytest

from svaedc.analysis.seeds import common_purpose, purpose


def test_tuning_begins_at_one_thousand():
    assert [purpose(seed) for seed in (0, 49, 999, 1000, 5000)] == ["reporting"] * 3 + ["tuning"] * 2


def test_seeds_have_one_purpose():
    assert common_purpose([3, 0, 49]) == "reporting"
    assert common_purpose({1003, 1000}) == "tuning"


def test_reporting_and_tuning_seeds_do_not_mix():
    with pytest.raises(ValueError, match=r"below 1000, for reporting.* got 999 to 1001"):
        common_purpose([1000, 999, 1001])
    with pytest.raises(ValueError, match="at least one seed"):
        common_purpose([])
