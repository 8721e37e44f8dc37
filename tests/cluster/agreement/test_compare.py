"""`svaedc setups compare`: what it prints and what it leaves."""

import json

import pytest
from PIL import Image

from cluster.agreement.compare import compare_setups
from cluster.errors import UsageError, UserError
from tests.cluster.cli import command_line
from workers import setups


@pytest.fixture(scope="module")
def quadratic():
    return setups.load("quadratic-30d")


def size_of(path):
    with Image.open(path) as image:
        return image.size


def test_a_setup_agrees_with_itself(quadratic, capsys, tmp_path):
    document = compare_setups(quadratic, quadratic, 0, 12, "same", tmp_path / "out")
    assert document == json.loads((tmp_path / "out" / "agreement.json").read_text())
    assert {each["name"] for each in document["measures"]} == {"objective", "badness", *quadratic.conditions}
    assert document["measures"][0]["spearman"] == pytest.approx(1.0)
    assert document["best"]["kept"] == 1.0
    said = capsys.readouterr().err
    assert "the best 6 of quadratic-30d" in said
    assert "no clips: quadratic-30d" in said
    assert size_of(tmp_path / "out" / "agreement.png")[0] > 600


@pytest.mark.slow
def test_two_engines_are_compared_with_clips_of_the_worst(tmp_path, capsys, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.setattr("cluster.agreement.compare.CLIPS", 1)  # of three, each takes twenty seconds
    franka, other = setups.load("franka"), setups.load("franka-mujoco")
    document = compare_setups(franka, other, 0, 6, "same", tmp_path)
    badness = next(each for each in document["measures"] if each["name"] == "badness")
    assert badness["spearman"] > 0.5
    assert document["setups"] == ["franka", "franka-mujoco"]
    clips = sorted(path.name for path in tmp_path.glob("*.gif"))
    assert clips == ["worst-1.gif"]
    assert size_of(tmp_path / "worst-1.gif") == (2 * 280 + 4, 230)
    assert "agreement.json, agreement.png, worst-1.gif" in capsys.readouterr().err


def test_setups_that_cannot_be_compared_are_refused(quadratic):
    with pytest.raises(UsageError, match="cannot run the same controllers"):
        compare_setups(quadratic, setups.load("franka"), 0, 10, "same", None)
    with pytest.raises(UsageError, match="mssing"):
        compare_setups(quadratic, quadratic, 0, 10, "mssing", None)


def test_setups_whose_episodes_do_not_end_are_refused(tmp_path, monkeypatch):
    (tmp_path / "failing_walk.py").write_text(
        "from dataclasses import replace\n"
        "from workers import setups\n"
        "from workers.environments.point import Point\n\n\n"
        "class Failing(Point):\n"
        "    def step(self, command):\n"
        "        raise KeyError('puck')\n\n\n"
        "def setup():\n"
        "    return replace(setups.load('quadratic-30d'), build=lambda: Failing(30))\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(UserError, match=r"only 0 controllers of 6 .*svaedc check --setup quadratic-30d"):
        compare_setups(setups.load("quadratic-30d"), setups.load("failing_walk"), 0, 6, "same", None)


@pytest.mark.slow
def test_the_command_prints_a_table_or_one_document(tmp_path):
    arguments = ("setups", "compare", "quadratic-30d", "quadratic-30d", "--controllers", "10", "--gap", "0.5")
    printed = command_line.svaedc(*arguments, folder=tmp_path)
    assert printed.returncode == 0
    assert "quadratic-30d (0.5)" in printed.stderr
    document = json.loads(command_line.svaedc(*arguments, "--json", folder=tmp_path).stdout)
    assert document["physics"] == "0.5"
    assert document["usable"] == 10


def test_the_list_is_still_what_setups_prints(tmp_path):
    listed = command_line.svaedc("setups", folder=tmp_path)
    assert listed.returncode == 0
    assert "franka-mujoco" in listed.stdout
