"""The settings: one default each, one error per bad key, and one file that Ray and we both read."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from pydantic import ValidationError

from cluster.config import Settings
from cluster.errors import UsageError
from cluster.settings import load_settings

REPOSITORY = Path(__file__).parents[2]
RAY_CONFIG = REPOSITORY / "ray_config.yaml"


def write(folder: Path, settings: str) -> Path:
    path = folder / "given.yaml"
    path.write_text(f"metadata:\n  svaedc: {settings}\n")
    return path


def test_no_file_in_the_working_directory_means_defaults(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_settings(None, []) == Settings()


def test_the_file_in_the_working_directory_is_read_without_being_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, "{train: {stride: 7}}").rename(tmp_path / "ray_config.yaml")
    assert load_settings(None, []).train.stride == 7


def test_a_file_that_is_given_must_exist(tmp_path):
    with pytest.raises(UsageError, match=r"absent\.yaml: No such file"):
        load_settings(tmp_path / "absent.yaml", [])


def test_the_command_line_wins_over_the_file_and_its_last_word_counts(tmp_path):
    path = write(tmp_path, "{collect: {actors: 3, attempts_per_shard: 5}}")
    settings = load_settings(path, ["collect.actors=4", "collect.actors=all", "train.time_limit_seconds=.5"])
    assert settings.collect.actors == "all"
    assert settings.collect.attempts_per_shard == 5
    assert settings.train.time_limit_seconds == 0.5


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("train.worker=2", "unknown setting 'train.worker', did you mean 'train.workers'?"),
        ("trian.workers=2", "unknown setting 'trian', did you mean 'train'?"),
        ("collect.actors=0", "collect.actors: .*greater than 0, got 0"),
        ("train.stride=1.5", "train.stride: .*integer.*, got 1.5"),
        ("tracking.uri=", "tracking.uri: .*, got None"),
        ("train.workers", "--set takes section.key=value, such as .*, got 'train.workers'"),
        ("workers=2", "--set takes section.key=value"),
        ("train.stride=[1", r"--set train.stride: '\[1' is not a YAML value"),
    ],
)
def test_a_bad_override_names_the_key_and_the_expectation(override, message):
    with pytest.raises(UsageError, match=message) as raised:
        load_settings(RAY_CONFIG, [override])
    assert raised.value.exit_code == 2


def test_an_unknown_key_in_a_file_names_the_file_and_the_nearest_key(tmp_path):
    path = write(tmp_path, "{compare: {slot: 2}}")
    with pytest.raises(
        UsageError, match=r"given\.yaml: unknown setting 'compare\.slot', did you mean 'compare\.slots'"
    ):
        load_settings(path, [])


def test_every_bad_key_is_reported_at_once(tmp_path):
    path = write(tmp_path, "{train: {stride: 0, workers: -1}}")
    with pytest.raises(UsageError, match=r"train\.workers.*; train\.stride"):
        load_settings(path, [])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("metadata: [1", "is not YAML"),
        ("- a list", "the file must be a mapping"),
        ("metadata: 3", "metadata must be a mapping"),
        ("metadata: {svaedc: {train: 3}}", r"metadata\.svaedc\.train must be a mapping .*, got 3"),
    ],
)
def test_a_malformed_file_is_refused_with_its_place(tmp_path, text, message):
    path = tmp_path / "given.yaml"
    path.write_text(text)
    with pytest.raises(UsageError, match=message):
        load_settings(path, [])


def test_a_file_of_ray_alone_means_defaults(tmp_path):
    path = tmp_path / "cluster.yaml"
    path.write_text("cluster_name: theirs\n")
    assert load_settings(path, []) == Settings()


def test_settings_cannot_change_after_they_are_read():
    with pytest.raises(ValidationError, match="frozen"):
        Settings().train.stride = 3


@pytest.mark.parametrize(("actors", "count"), [("all", 6), (2, 2)])
def test_all_actors_means_one_per_cpu(actors, count):
    settings = load_settings(RAY_CONFIG, [f"collect.actors={actors}"])
    assert settings.collect.actor_count(6) == count


def test_the_shipped_file_changes_no_default():
    assert load_settings(RAY_CONFIG, []) == Settings()


def test_the_values_shown_in_the_shipped_file_are_all_the_defaults():
    uncommented = re.sub(r"(?m)^(      )# (\w+: )", r"\1\2", RAY_CONFIG.read_text())
    shown = yaml.safe_load(uncommented)["metadata"]["svaedc"]
    assert Settings.model_validate(shown) == Settings()
    assert {section: set(keys) for section, keys in shown.items()} == {
        section: set(keys) for section, keys in Settings().model_dump().items()
    }


def test_the_shipped_file_is_a_valid_ray_cluster_file():
    launcher = pytest.importorskip("ray.autoscaler._private.util")
    described = launcher.prepare_config(yaml.safe_load(RAY_CONFIG.read_text()))
    launcher.validate_config(described)
    assert described["provider"]["type"] == "local"


def test_reading_settings_loads_neither_ray_nor_torch_nor_mlflow():
    program = "import sys, cluster.config; print(sorted({'ray', 'torch', 'mlflow'} & set(sys.modules)))"
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "[]"


@pytest.mark.parametrize("seconds", [".inf", ".nan", "0", "1e10"])
def test_a_time_in_which_no_connection_can_be_awaited_is_refused(seconds):
    with pytest.raises(UsageError, match="connect_timeout_seconds"):
        load_settings(None, [f"ray.connect_timeout_seconds={seconds}"])
