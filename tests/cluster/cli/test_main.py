"""The command line as a user meets it: help that teaches, one-line errors, exit codes."""

import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from platform import python_version

import pytest

from cluster.cli.main import main
from tests.cluster.cli.command_line import svaedc

COMPARE = ("compare", "--setup", "franka", "--out", "out", "--address", "127.0.0.1:1")

COLLECT = ("collect", "--episodes", "8", "--dataset", "data")
CANDIDATES = ("candidates", "--setup", "franka", "--out", "candidates")


def test_help_names_every_command_and_loads_neither_ray_nor_torch(tmp_path):
    result = svaedc("--help", folder=tmp_path)
    assert result.returncode == 0
    for command in (
        "demo",
        "collect",
        "train",
        "compare",
        "reproduce",
        "render",
        "ui",
        "dataset",
        "hardware",
    ):
        assert command in result.stdout
    heavy = {"ray", "torch", "mlflow", "pybullet"}
    loaded = f"import cluster.cli.main, sys; print(sorted({heavy} & sys.modules.keys()))"
    listed = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True)
    assert listed.stdout.strip() == "[]"


def test_the_version_is_told_with_pythons(tmp_path):
    assert (
        svaedc("--version", folder=tmp_path).stdout
        == f"svaedc {version('svaedc')}, Python {python_version()}\n"
    )


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_completes_commands_and_options(shell):
    ask = {"bash": {"COMP_WORDS": "svaedc col", "COMP_CWORD": "1"}}.get(
        shell, {"_TYPER_COMPLETE_ARGS": "svaedc col"}
    )
    environment = {
        **os.environ,
        "_SVAEDC_COMPLETE": f"complete_{shell}",
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
        **ask,
    }
    command = Path(sys.executable).parent / "svaedc"
    said = subprocess.run([command], env=environment, capture_output=True, encoding="utf-8", check=False)
    assert "collect" in said.stdout, said.stderr
    assert "compare" not in said.stdout


def test_help_spends_a_few_lines_on_options_of_all_commands(tmp_path):
    said = svaedc("--help", folder=tmp_path).stdout
    options = said.partition("Options")[2].partition("Commands")[0]
    for option in ("--version", "--install-completion", "--show-completion", "--help"):
        assert option in options
    assert options.count("\n") < 9


def test_a_mistake_is_one_line_where_no_terminal_is(tmp_path):
    said = svaedc(
        "collect", "--setup", "franka", "--dataset", "d" * 300, "--episodes", "many", folder=tmp_path
    )
    assert said.returncode == 2
    assert said.stderr.count("\n") == 1
    assert said.stderr.startswith("error: Invalid value for '--episodes': ")
    assert "`svaedc collect --help` says what it takes" in said.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ((*COLLECT, "--setup", "frnaka"), 2, "unknown setup 'frnaka'; did you mean 'franka'?"),
        ((*COLLECT, "--setup", "franka", "--set", "collect.actor=2"), 2, "did you mean 'collect.actors'?"),
        (
            (*COLLECT, "--setup", "franka", "--config", "none.yaml"),
            2,
            "cannot read the settings file none.yaml",
        ),
        (("dataset", "info", "nowhere"), 1, "nowhere holds no dataset"),
        (("dataset", "verify", "nowhere"), 1, "nowhere holds no dataset"),
        (("hardware", "status", "nowhere"), 1, "nowhere"),
        (("collect",), 2, "Missing option"),
        # That nothing answers there would be found out first, if Ray were started before the refusal.
        ((*COMPARE, "--methods", ","), 2, "--methods must name at least one of bbk-kl, botorch"),
        (
            ("reproduce", "figure-9", "--dataset", "data", "--episodes", "300", "--plan"),
            2,
            "--dataset is collected already: leave one out",
        ),
        (("reproduce", "figure-9", "--set", "train.latent=15x12"), 2, "leave train.latent out"),
        ((*COMPARE, "--methods", "se,svae"), 2, "svae need a trained model: name its folder with --model"),
        (
            (*COMPARE, "--methods", "prior-se,simulated-best"),
            2,
            "prior-se, simulated-best need candidates that were simulated",
        ),
        ((*COMPARE, "--methods", "se", "--candidates", "nowhere"), 1, "there are no candidates in"),
        ((*CANDIDATES, "--keep", "worst"), 2, "--keep must be one of best, least-bad, got 'worst'"),
        ((*CANDIDATES, "--gap", "narrow"), 2, "unknown gap level 'narrow'"),
        ((*CANDIDATES, "--also", "yumi"), 2, "franka and yumi cannot run the same controllers"),
    ],
)
def test_a_mistake_is_one_message_and_an_exit_code(tmp_path, arguments, code, message, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["svaedc", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    said = capfd.readouterr().err
    assert end.value.code == code, said
    assert message in " ".join(said.replace("│", " ").split())
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--address", "127.0.0.1:1"), "no Ray cluster answers at 127.0.0.1:1"),
        (
            ("--set", "tracking.uri=sqlite:////proc/none/mlflow.db"),
            "the MLflow store sqlite:////proc/none/mlflow.db cannot be used",
        ),
    ],
)
def test_a_service_that_is_not_there_is_named_in_one_line(tmp_path, arguments, message):
    result = svaedc(*COLLECT, "--setup", "franka", *arguments, folder=tmp_path)
    assert result.returncode == 1, result.stderr
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_job_refuses_paths_that_ray_will_delete(tmp_path):
    package = tmp_path / "working_dir_files" / "_ray_pkg_1"
    package.mkdir(parents=True)
    result = svaedc(*COLLECT, "--setup", "franka", folder=package)
    assert result.returncode == 2, result.stderr
    assert "data would be deleted with the job's copy of the working directory" in result.stderr
    absolute = ("collect", "--episodes", "8", "--dataset", str(tmp_path / "data"), "--setup", "franka")
    result = svaedc(*absolute, folder=package)
    assert result.returncode == 2, result.stderr
    assert "mlflow.db would be deleted" in result.stderr
