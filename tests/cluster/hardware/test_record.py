"""What is kept of a campaign beside its journal, and what is made of it."""

import csv
import hashlib
import io
import json
import os
import shutil
import stat
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware import operator
from cluster.hardware.executor import Executor
from cluster.hardware.record.attachments import LIST, attachments, damage, take_over
from cluster.hardware.record.export import export, lines, report
from cluster.hardware.record.rows import COLUMNS
from tests.cluster.hardware.rehearsals import ROBOT, carried_out, plan_in
from workers import setups
from workers.hardware.rehearsal import RehearsalMachine
from workers.hardware.robots import ROBOTS

NASTY = ("../../etc/passwd.txt", "<script>alert(1)</script>.mp4", "a\nb.log", "ü" * 80 + ".TXT", ".hidden")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of a campaign of three measured trials."""
    folder = tmp_path_factory.mktemp("campaign")
    carried_out(plan_in(folder, "random", 1))
    return folder


@pytest.fixture
def campaign(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "campaign")


def test_commands_and_trajectory_of_every_trial_are_kept_as_parquet(whole):
    kept = {(each.trial, each.name): each for each in attachments(whole)}
    assert kept.keys() == {
        (trial, f"{name}.parquet") for trial in range(3) for name in ("commands", "trajectory")
    }
    setup = setups.load("franka")
    events = [json.loads(line) for line in lines(whole)][1:]
    evidence = [json.loads(each["body"])["evidence"] for each in events if each["new"] == "measured"]
    for trial in range(3):
        xi = pyarrow.parquet.read_table(whole / kept[trial, "trajectory.parquet"].file)
        assert xi.column_names == [channel.name for channel in setup.observation]
        numbers = np.array([xi[name].to_numpy() for name in xi.column_names]).astype(np.float32)
        assert hashlib.sha256(numbers.tobytes()).hexdigest() == evidence[trial]
        sent = pyarrow.parquet.read_table(whole / kept[trial, "commands.parquet"].file)
        assert sent.num_rows == setup.horizon
        assert sent.column_names[0] == "seconds"
    assert list(damage(whole)) == []


def test_nothing_is_left_at_the_robot_and_a_second_start_keeps_nothing_twice(tmp_path):
    plan = plan_in(tmp_path / "campaign", "random", 0)
    carried_out(plan)
    before = attachments(plan.folder)
    executor = Executor(plan)
    home = executor._home
    executor.close()
    assert attachments(plan.folder) == before
    name = operator.status(plan.folder).name
    assert not [path for path in home.trials.glob(f"{name}*")]


def test_what_a_dead_process_left_at_the_robot_is_taken_over(campaign, tmp_path):
    recorded = tmp_path / "recorded"
    recorded.mkdir()
    (recorded / "video.mp4").write_bytes(b"frames")
    (recorded / "odd.csv").write_bytes(b"a,b\n1\n")
    take_over(campaign, recorded, 2)
    take_over(campaign, recorded, 2)
    assert [(each.trial, each.name) for each in attachments(campaign)[-2:]] == [
        (2, "odd.csv"),
        (2, "video.mp4"),
    ]
    assert not recorded.exists()


def test_a_file_is_kept_by_its_bytes_whatever_it_is_called(campaign, tmp_path):
    for number, name in enumerate(NASTY):
        path = tmp_path / str(number) / Path(name).name
        path.parent.mkdir()
        path.write_bytes(f"content {number}".encode())
        kept = operator.attach(campaign, 0, path, "Ada", "seen <b>it</b>")
        assert kept.file.startswith(f"attachments/{hashlib.sha256(path.read_bytes()).hexdigest()}")
        assert (campaign / kept.file).read_bytes() == path.read_bytes()
        assert operator.attach(campaign, 0, path, "Bob", "again") == kept
    assert len(attachments(campaign)) == 6 + len(NASTY)
    report(campaign, campaign / "report.html")
    assert "<script>" not in (campaign / "report.html").read_text(encoding="utf-8")


def test_refusals_name_what_is_missing(campaign, tmp_path):
    path = tmp_path / "log.txt"
    path.write_text("log", encoding="utf-8")
    with pytest.raises(UsageError, match="who must name a person"):
        operator.attach(campaign, 0, path, " ", "")
    with pytest.raises(UsageError, match="there is no file"):
        operator.attach(campaign, 0, tmp_path / "none", "Ada", "")
    with pytest.raises(UserError, match="no trial 9"):
        operator.attach(campaign, 9, path, "Ada", "")
    with pytest.raises(UsageError, match="--as must be one of jsonl, csv, parquet"):
        export(campaign, "xlsx", None)
    with pytest.raises(UsageError, match="parquet is no text"):
        export(campaign, "parquet", None)


def test_damage_is_told_by_file_and_a_damaged_list_is_refused(campaign):
    first, second = attachments(campaign)[:2]
    (campaign / first.file).write_bytes(b"other")
    (campaign / second.file).unlink()
    told = list(damage(campaign))
    assert "has other bytes than were attached" in told[0]
    assert "cannot be read" in told[1]
    content = (campaign / LIST).read_bytes()
    (campaign / LIST).write_bytes(content.replace(b"trajectory", b"trajectorY", 1))
    with pytest.raises(UserError, match="the list of attachments is damaged"):
        attachments(campaign)


def test_tables_have_a_row_for_every_trial_and_the_journals_numbers(whole, tmp_path):
    trials = operator.status(whole).trials
    read = list(csv.DictReader(io.StringIO(export(whole, "csv", None))))
    export(whole, "parquet", tmp_path / "trials.parquet")
    table = pyarrow.parquet.read_table(tmp_path / "trials.parquet").to_pylist()
    assert len(read) == len(table) == len(trials) == 3
    for row, other, trial in zip(read, table, trials, strict=True):
        assert list(row) == list(other) == [*COLUMNS, *(f"x_{number}" for number in range(48))]
        assert (float(row["f"]), float(row["y"])) == (other["f"], other["y"]) == trial.measurement
        assert [float(row[f"x_{number}"]) for number in range(48)] == trial.x.tolist()
        assert (row["kind"], row["approved_by"]) == (trial.kind, "policy: rehearsal")


def test_an_amendment_and_a_note_are_in_the_table(campaign):
    operator.amend(campaign, 1, "Ada", "the ruler slipped", f=0.25, y=0.5)
    rows = list(csv.DictReader(io.StringIO(export(campaign, "csv", None))))
    assert (rows[1]["f"], rows[1]["amended"], rows[1]["note"]) == ("0.25", "1", "the ruler slipped")
    assert (rows[1]["decided_by"], rows[0]["amended"]) == ("operator: Ada", "0")


class Page(HTMLParser):
    """What a browser would load, link to and show."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.links, self.sources, self.words = set(), [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.links += [value for name, value in attrs if name == "href"]
        self.sources += [value for name, value in attrs if name == "src"]

    def handle_data(self, data):
        self.words.append(data)


def test_the_page_tells_every_trial_and_event_and_loads_nothing(campaign):
    operator.amend(campaign, 1, "Ada", "the ruler slipped", f=0.25, y=0.5)
    report(campaign, campaign / "report.html")
    page = Page((campaign / "report.html").read_text(encoding="utf-8"))
    text = " ".join(page.words)
    assert "the ruler slipped" in text
    assert "a simulated stand-in: no robot moved" in text
    assert "script" not in page.tags
    assert all(source.startswith("data:image/svg+xml;base64,") for source in page.sources)
    assert sorted(page.links) == sorted(each.file for each in attachments(campaign))
    for trial in operator.status(campaign).trials:
        assert f"{trial.f:.3f}" in text


def test_a_campaign_without_a_trial_has_a_page_and_an_empty_table(tmp_path):
    executor = Executor(plan_in(tmp_path / "campaign", "random", 0))
    executor.close()
    report(tmp_path / "campaign", tmp_path / "report.html")
    assert "0 of 0 trials were measured" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert export(tmp_path / "campaign", "csv", None) == ",".join(COLUMNS) + "\n"


@pytest.mark.skipif(os.getuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_only_be_read_is_exported(campaign):
    for path in (campaign, *campaign.rglob("*")):
        path.chmod(path.stat().st_mode & ~stat.S_IWUSR)
    assert export(campaign, "csv", None).count("\n") == 4


def test_a_machine_without_a_folder_records_nothing(tmp_path):
    machine = RehearsalMachine(**ROBOTS[ROBOT].settings, seed=3)
    machine.begin([0.5] * 48)
    while (command := machine.command(0)) is not None:
        machine.send(command)
    assert machine.end()["evidence"]
    machine.close()
    assert list(tmp_path.iterdir()) == []
