"""The executor, on the real rehearsal robot: to the end, in pieces, and refused."""

import pytest

from cluster.errors import UserError
from cluster.hardware.executor import Executor
from cluster.hardware.identity import IdentityMismatch
from cluster.hardware.lock import FolderTaken
from cluster.hardware.robot.residence import home_of_campaign
from cluster.hardware.status import Phase
from svaedc.bo import methods
from tests.cluster.hardware.rehearsals import carried_out, plan_in


@pytest.mark.parametrize("method", ["random", "se", "svae-dc"])
def test_a_rehearsal_campaign_runs_to_its_end(tmp_path, model, method):
    seen = carried_out(plan_in(tmp_path / method, method, 2, model if methods.needs_model(method) else None))
    assert seen.phase is Phase.COMPLETE
    assert [trial.kind for trial in seen.trials] == ["random", "random", "suggested", "suggested"]
    known = home_of_campaign(tmp_path / method, "franka-rehearsal").ledger.entries()
    own = [entry for entry in known if str(entry.facts.get("trial", "")).startswith(seen.name)]
    assert [entry.event for entry in own] == ["granted", "started", "ended"] * 4


@pytest.mark.parametrize("method", ["se", "svae-dc"])
def test_an_interrupted_campaign_proposes_bit_for_bit_what_an_undisturbed_one_does(tmp_path, model, method):
    used = model if methods.needs_model(method) else None
    whole = carried_out(plan_in(tmp_path / "whole", method, 2, used))
    seen = None
    while seen is None or seen.phase is Phase.READY:
        executor = Executor(plan_in(tmp_path / "pieces", method, 2, used))
        seen = executor.advance()
        executor.close()
    assert [(t.x_hex, t.f, t.y) for t in seen.trials] == [(t.x_hex, t.f, t.y) for t in whole.trials]


def test_another_campaign_in_the_folder_is_refused_naming_the_field(tmp_path):
    carried_out(plan_in(tmp_path, trials=0))
    with pytest.raises(IdentityMismatch, match="holds a campaign with trials '0', asked for '1'"):
        Executor(plan_in(tmp_path, trials=1))
    assert carried_out(plan_in(tmp_path, trials=0)).phase is Phase.COMPLETE


def test_a_second_executor_is_refused_while_the_first_holds_the_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("cluster.hardware.executor.PATIENCE_SECONDS", 0.1)
    first = Executor(plan_in(tmp_path))
    with pytest.raises(FolderTaken, match="is being executed by process"):
        Executor(plan_in(tmp_path))
    first.close()
    second = Executor(plan_in(tmp_path))
    assert second.status().phase is Phase.READY
    second.close()


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot make the folder"):
        Executor(plan_in(tmp_path / "file" / "campaign"))
