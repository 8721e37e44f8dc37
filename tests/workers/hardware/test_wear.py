"""What a robot has gone through, counted from its ledger."""

import pytest

from workers.hardware.wear import Wear, wear
from workers.host.ledger import Ledger
from workers.host.limits import HostChannel
from workers.host.recording import make_folder, travel, write_table


def test_counters_add_up_over_trials_and_take_lines_of_before(tmp_path):
    ledger = Ledger(tmp_path / "ledger.jsonl")
    ledger.append("started", {"trial": "a"})
    ledger.append(
        "ended", {"trial": "a", "commands": 10, "seconds": 1.5, "travel": {"hip": 2.0, "knee": 1.0}}
    )
    ledger.append("started", {"trial": "b"})
    ledger.append("broken", {"trial": "b", "commands": 4, "seconds": 0.5, "travel": {"hip": 1.0}})
    ledger.append("started", {"trial": "c"})
    ledger.append("ended", {"trial": "c", "commands": 3})
    assert wear(ledger.entries()) == Wear(3, 1, 17, 2.0, {"hip": 3.0, "knee": 1.0})
    assert wear([]) == Wear()


def test_travel_is_the_way_that_joints_were_sent():
    channels = (
        HostChannel("hip", "position", "rad"),
        HostChannel("wheel", "speed", "rad/s"),
        HostChannel("grip", "torque", "Nm"),
    )
    sent = [(0.0, 0.0, 2.0, 9.0), (0.1, 0.5, -2.0, 9.0), (0.2, 0.25, 1.0, 9.0)]
    assert travel(channels, 0.1, sent) == pytest.approx({"hip": 0.75, "wheel": 0.5})
    assert travel(channels, 0.1, []) == {"hip": 0, "wheel": 0}


def test_tables_are_read_back_to_the_last_bit(tmp_path):
    write_table(tmp_path / "t.csv", ["a", "b"], [[0.1, 1e-300], [1 / 3, -0.0]])
    header, *rows = (tmp_path / "t.csv").read_text(encoding="utf-8").splitlines()
    assert header == "a,b"
    assert [[float(value) for value in row.split(",")] for row in rows] == [[0.1, 1e-300], [1 / 3, -0.0]]


@pytest.mark.parametrize("name", ["", ".", "..", "../up", "a/b", ".hidden"])
def test_a_trial_whose_name_is_no_folder_is_refused(tmp_path, name):
    with pytest.raises(ValueError, match="a trial must have a name that a folder can have"):
        make_folder(tmp_path, name)
