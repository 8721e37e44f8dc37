"""The commands, as far as they go before anything starts."""

import pytest
from typer.testing import CliRunner

from cluster.cli.hardware import app
from cluster.errors import UsageError


@pytest.fixture
def job(tmp_path, monkeypatch):
    """A submitted job's copy of the working directory, which Ray deletes when the job has ended."""
    package = tmp_path / "working_dir_files" / "_ray_pkg_1"
    package.mkdir(parents=True)
    monkeypatch.chdir(package)


def refusal(*arguments):
    error = CliRunner().invoke(app, arguments).exception
    assert isinstance(error, UsageError)
    return str(error)


@pytest.mark.usefixtures("job")
@pytest.mark.parametrize(
    "command",
    [
        ("start", "--robot", "franka-rehearsal", "--method", "random"),
        ("status",),
        ("approve", "--trial", "0", "--who", "Ada"),
        ("withdraw", "--trial", "0", "--who", "Ada"),
        ("reject", "--trial", "0", "--who", "Ada", "--note", "it fell"),
        ("amend", "--trial", "0", "--who", "Ada", "--note", "tape", "--f", "0.1", "--y", "0"),
        ("adopt", "--who", "Ada"),
        ("resolve", "--trial", "0", "--outcome", "failed", "--who", "Ada", "--note", "it fell"),
        ("export",),
    ],
    ids=lambda command: command[0],
)
def test_a_job_refuses_a_campaign_that_ray_will_delete(command):
    message = refusal(*command, "campaigns/one")
    assert "campaigns/one would be deleted with the job's copy of the working directory" in message
    assert "one on a local disk of the robot's machine" in message


@pytest.mark.usefixtures("job")
def test_a_job_refuses_a_tracking_store_that_ray_will_delete(tmp_path):
    arguments = ("--robot", "franka-rehearsal", "--method", "random")
    assert "mlflow.db would be deleted" in refusal("start", str(tmp_path / "one"), *arguments)
