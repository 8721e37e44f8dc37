"""The station: one campaign has the robot, and it is handed on when its driver is gone."""

from dataclasses import replace

import pytest

from cluster.hardware import operator, station
from cluster.hardware.station import RobotBusy, Station
from tests.cluster.hardware.rehearsals import plan_in


def test_a_station_goes_on_with_the_campaign_it_has(tmp_path):
    post = Station()
    plan = plan_in(tmp_path)
    post.enter(plan)
    post.advance(plan)
    assert post.enter(replace(plan, pace=0.1)).measured == 1
    post.leave()


def test_a_station_refuses_another_campaign_while_the_drivers_of_the_first_ask(tmp_path):
    post = Station()
    post.enter(plan_in(tmp_path / "first"))
    with pytest.raises(RobotBusy, match=r"is held by the campaign in .*first"):
        post.enter(plan_in(tmp_path / "second"))
    with pytest.raises(RobotBusy, match=r"no longer serves the campaign in .*second"):
        post.advance(plan_in(tmp_path / "second"))
    post.leave()


def test_a_station_whose_driver_is_gone_is_handed_on_between_trials(tmp_path, monkeypatch):
    monkeypatch.setattr(station, "IDLE_SECONDS", 0.0)
    post = Station()
    first, second = plan_in(tmp_path / "first"), plan_in(tmp_path / "second")
    post.enter(first)
    post.enter(second)
    assert post.advance(second).measured == 1
    with pytest.raises(RobotBusy, match="no longer serves"):
        post.advance(first)
    post.leave()
    assert operator.status(tmp_path / "first").measured == 0


def test_a_driver_that_withdraws_empties_only_its_own_place(tmp_path):
    post = Station()
    plan, other = plan_in(tmp_path / "first"), plan_in(tmp_path / "second")
    assert post.withdraw(other)
    post.enter(plan)
    assert not post.withdraw(other)
    assert post.advance(plan).measured == 1
    assert post.withdraw(plan)
    post.enter(other)
    post.leave()
