"""The ledger of motions."""

import hashlib
import json

import numpy as np
import pytest

from workers.hardware.driver import Measurement
from workers.hardware.ledger import MotionLedger

EVIDENCE = "ab" * 32


@pytest.mark.parametrize("torn", [b'{"event": "star', b'{"event": "started", "trial"', b"\xff\xfe", b"17"])
def test_a_torn_last_line_never_happened_and_hurts_no_later_one(tmp_path, torn):
    ledger = MotionLedger(tmp_path / "starts.jsonl")
    ledger.start("a", np.zeros(2))
    with ledger.path.open("ab") as file:
        file.write(torn)
    ledger.start("b", np.zeros(2))
    assert [entry["trial"] for entry in ledger.entries()] == ["a", "b"]
    assert ledger.motion("b").started


def test_the_ledger_is_lines_of_json_that_name_the_controller(tmp_path):
    ledger = MotionLedger(tmp_path / "starts.jsonl")
    x = np.array([0.25, 0.5])
    ledger.start("a", x)
    ledger.end("a", Measurement(0.5, 0.25, "", 1.0, EVIDENCE))
    started, ended = (json.loads(line) for line in ledger.path.read_text().splitlines())
    assert started["x"] == hashlib.sha256(x.tobytes()).hexdigest()
    assert Measurement(**ended["measurement"]) == Measurement(0.5, 0.25, "", 1.0, EVIDENCE)
