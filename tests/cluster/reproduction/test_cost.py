"""The cost of a reproduction."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from cluster.comparison.records import RunKey, append
from cluster.config import Settings
from cluster.errors import UserError
from cluster.reproduction.cost import cost_items, lines
from svaedc.bo.loop import Trial
from tests.cluster.reproduction.tiny import TINY, costs, plan_of


def test_a_damaged_dataset_in_the_way_is_refused_before_its_bill(tmp_path):
    push = plan_of(TINY, tmp_path)
    push.dataset.mkdir(parents=True)
    (push.dataset / "dataset.json").write_text("{")
    with pytest.raises(UserError, match="cannot use the dataset"):
        costs(push)


def test_panels_that_need_the_same_candidates_share_them_and_they_are_billed_once(tmp_path):
    panels = [replace(TINY.panels[0], name=name, candidates=("franka",)) for name in ("one", "two")]
    recipe = replace(TINY, panels=(*panels, replace(panels[0], name="three", candidates=())), claims=())
    plan = plan_of(recipe, tmp_path)
    assert {plan.candidates(panel).name for panel in panels} == {"franka-2000x6-by-franka-300-compact-3x3"}
    simulated = {step: cost for step, cost in costs(plan).items() if "candidates" in step}
    assert simulated.keys() == {"candidates in franka"}
    assert simulated["candidates in franka"].core_seconds == pytest.approx(12_000 * 0.027)


def test_the_bill_is_the_sum_of_single_costs_and_shrinks_by_what_is_there(tmp_path, few_episodes):
    whole = plan_of(TINY, tmp_path)
    items = costs(whole)
    # 300 episodes of 27 ms on two cores, 4,000 updates of 160 ms on one.
    assert items["collect 300 of 300 episodes of franka"].core_seconds == pytest.approx(300 * 0.027)
    assert items["collect 300 of 300 episodes of franka"].seconds == pytest.approx(300 * 0.027 / 2)
    assert items["train 3x3"].seconds == pytest.approx(4000 * 0.16)
    shutil.copytree(few_episodes, whole.dataset)
    for index in range(2):
        trial = Trial(index, np.zeros(48, np.float32), 0.1, 0.0, 0.1, False, "ok", 0.1, "")
        (whole.comparison(TINY.panels[0]) / "runs").mkdir(parents=True, exist_ok=True)
        append(RunKey("random", 0).path(whole.comparison(TINY.panels[0])), trial)
    said = "\n".join(lines(whole, cost_items(whole, Settings(), 2), 2))
    assert "collect 292 of 300 episodes of franka" in said
    # Four runs of four trials, of which one is half done.
    assert sum(item.cost.size for item in cost_items(whole, Settings(), 2)[2:]) == 3.5 * 4 * 400
    assert "in all" in said
