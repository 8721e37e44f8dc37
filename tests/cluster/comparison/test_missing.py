"""What a comparison lacks, in a sentence and as plain values."""

from cluster.comparison.missing import missing_runs
from cluster.comparison.records import RunKey
from tests.cluster.comparison.comparing import trial


def test_nothing_is_said_of_a_whole_comparison():
    missing = missing_runs([RunKey("se", 0)], {RunKey("se", 0): [trial(0), trial(1)]}, 2)
    assert (str(missing), missing.as_json()) == ("", [])


def test_runs_that_are_short_and_runs_that_have_not_begun_are_named():
    asked = [RunKey(method, run) for run in (0, 1) for method in ("random", "se")]
    runs = {asked[0]: [trial(0), trial(1)], asked[3]: [trial(0)]}
    missing = missing_runs(asked, runs, 2)
    assert str(missing) == (
        "3 of 4 runs are not whole (2 trials each): se 1 has 1 trial, se 0 has not begun and random 1 has "
        "not begun. `svaedc compare` goes on with them"
    )
    assert missing.as_json()[0] == {"method": "se", "run": 0, "trials": 0, "of": 2}
    one = missing_runs(asked[3:], runs, 2)
    assert str(one).startswith("1 of 1 run is not whole (2 trials each): se 1 has 1 trial.")


def test_a_long_list_is_cut_short():
    asked = [RunKey("se", run) for run in range(20)]
    assert "se 5 has not begun and 14 more. " in str(missing_runs(asked, {}, 3))
