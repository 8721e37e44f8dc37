"""How a campaign stands, as plain values."""

import json
import math

from cluster.hardware import operator
from tests.cluster.hardware.desk import DIMENSIONS, IDENTITY, carry_out, objective, opened


def test_a_campaign_is_told_as_strict_json(tmp_path):
    carry_out(tmp_path, faulty=frozenset({1}))
    told = json.loads(json.dumps(operator.status(tmp_path).as_json(), allow_nan=False))
    assert (told["campaign"], told["robot"], told["seed"]) == ("desk-1", "desk", IDENTITY.seed)
    assert told["phase"] == str(operator.status(tmp_path).phase)
    assert told["planned"] == IDENTITY.trials + 2
    failed = told["trials"][1]
    assert (failed["number"], failed["state"], failed["f"], failed["y"]) == (1, "failed", None, None)
    for trial, kept in zip(told["trials"], opened(tmp_path).trials(), strict=True):
        assert trial["x"] == kept.x.tolist()
        assert len(trial["x"]) == DIMENSIONS
        assert trial["f"] is None or math.isclose(trial["f"], objective(kept.x))
    assert told["best"] == max(trial["f"] for trial in told["trials"] if trial["f"] is not None)
