"""The settings: one default each, one error per bad key, and one file that Ray and we both read."""

import re
import subprocess
import sys
from math import inf
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
        ("collect.actors=0", "collect.actors: .*greater than 0, got '0'"),
        ("train.stride=1.5", "train.stride: .*integer.*, got '1.5'"),
        ("tracking.uri=", "tracking.uri: .*at least 1 character, got ''"),
        ("tracking.uri=sqlite:///", "tracking.uri: .*sqlite:///FILE must name a file"),
        ("tracking.uri=sqlite:///runs/", "tracking.uri: .*sqlite:///FILE must name a file"),
        ("train.workers", "--set takes section.key=value, such as .*, got 'train.workers'"),
        ("workers=2", "--set takes section.key=value"),
        ("train.stride=[1", r"train.stride: .*integer.*, got '\[1'"),
    ],
)
def test_a_bad_override_names_the_key_and_the_expectation(override, message):
    with pytest.raises(UsageError, match=message) as raised:
        load_settings(RAY_CONFIG, [override])
    assert raised.value.exit_code == 2


@pytest.mark.parametrize(
    "text",
    [
        "runs #1",
        "a: b",
        "- a",
        "[1",
        "{a",
        "'quoted'",
        "&a",
        "*a",
        "!a",
        "yes",
        "null",
        "1e3",
        "007",
        "a=b",
        "?",
        "%20",
    ],
)
def test_a_text_means_itself_whatever_it_would_mean_in_yaml(text):
    settings = load_settings(None, [f"tracking.experiment={text}", f"tracking.uri=sqlite:///{text}.db"])
    assert settings.tracking.experiment == text
    assert settings.tracking.file == Path(f"{text}.db")


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("collect.actors=all", "all"),
        ("collect.actors=4", 4),
        ("ray.object_store_memory=300_000_000", 300_000_000),
        ("train.time_limit_seconds=.inf", inf),
        ("train.time_limit_seconds=inf", inf),
        ("train.time_limit_seconds=.5", 0.5),
        ("train.time_limit_seconds= 1e3 ", 1000.0),
        ("train.kl_weight=0", 0.0),
        ("train.kl_weight=preset", "preset"),
        ("train.updates=300", 300),
        ("train.cache_folder=cache #1", Path("cache #1")),
        ("train.cache_folder=~/cache", Path.home() / "cache"),
        ("tracking.uri=http://tracker:5000", "http://tracker:5000"),
    ],
)
def test_plain_text_becomes_what_the_setting_is(override, value):
    section, _, key = override.partition("=")[0].partition(".")
    given = getattr(getattr(load_settings(None, [override]), section), key)
    assert given == value
    assert type(given) is type(value)


@pytest.mark.parametrize(
    ("text", "key", "line"),
    [
        ("metadata:\n  svaedc:\n    train: {stride: 5, workers: 1}\n    train: {}\n", "train", 4),
        (
            "metadata:\n  svaedc:\n    train:\n      stride: 5\n      workers: 1\n      stride: 6\n",
            "stride",
            6,
        ),
        ("cluster_name: a\nmetadata: {}\nmetadata: {}\n", "metadata", 3),
        ('metadata:\n  svaedc:\n    train: {stride: 1}\n    "train": {}\n', "train", 4),
        ("auth:\n  ssh_user: a\n  ssh_user: b\n", "ssh_user", 3),
    ],
)
def test_a_key_that_stands_twice_is_named_with_its_line(tmp_path, text, key, line):
    path = tmp_path / "given.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError, match=rf"given\.yaml, line {line}: {key!r} stands in line \d already"):
        load_settings(path, [])


def test_keys_may_be_shared_by_reference_and_stand_in_other_mappings(tmp_path):
    path = tmp_path / "given.yaml"
    shared = "all: &all {slots: 3}\n"
    shared += "metadata: {svaedc: {compare: {<<: *all, pool_size: 9}, hardware: {pool_size: 8}}}"
    path.write_text(shared, encoding="utf-8")
    settings = load_settings(path, [])
    assert (settings.compare.slots, settings.compare.pool_size, settings.hardware.pool_size) == (3, 9, 8)


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
