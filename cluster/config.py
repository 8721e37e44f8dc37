"""The settings: typed sections.

Every default is here and nowhere else; a driver receives only its own section. Importing this module loads
neither Ray nor torch.
"""

from math import inf
from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
)

UserPath = Annotated[Path, AfterValidator(Path.expanduser)]
"""A path in which a leading `~` stands for the user's home."""


Part = Literal["dashboard"]
"""What a cluster started by a command may do without: the dashboard, which Ray Train queries all the time."""


class Section(BaseModel):
    """What all sections share: they cannot change, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class RaySettings(Section):
    """A Ray cluster started by the command itself; unused when it joins a running one."""

    num_cpus: PositiveInt | Literal["all"] = "all"
    """CPUs the cluster offers; `all` is every CPU this process may use."""
    object_store_memory: int = Field(default=300_000_000, ge=80_000_000)
    """Bytes of shared memory for objects; results here are small, so little is needed."""
    temporary_folder: UserPath = Path("/tmp/ray")
    """Sockets and logs; short, because a socket's whole path may have 107 characters."""
    log_file_bytes: int = Field(default=20_000_000, ge=100_000)
    """Bytes after which a process of Ray begins its log anew; the full one before it is kept."""
    connect_timeout_seconds: float = Field(default=5.0, gt=0.0, le=3600.0)
    """How long a running cluster has to accept a connection; at most an hour."""


class CollectSettings(Section):
    """`svaedc collect`: how rollouts are spread over actors."""

    actors: PositiveInt | Literal["all"] = "all"
    """Rollout processes, one CPU each; `all` is one per CPU of the cluster."""
    episodes_per_shard: PositiveInt = 256
    """Rows of one Parquet file; part of a dataset's identity."""
    storage: Literal["float32", "int16"] = "float32"
    """Of trajectories: exact, or codes between their channels' bounds; part of a dataset's identity."""
    shards_in_flight_per_actor: PositiveInt = 1
    """Shards handed to an actor ahead of its finishing the first."""
    attempts_per_shard: PositiveInt = 3
    """Failures after which a shard is put aside with its error."""
    shard_timeout_seconds: PositiveFloat = 1800.0
    """Time after which a shard counts as failed and its actor is replaced."""

    def actor_count(self, cpus: int) -> int:
        """Rollout actors on a cluster with this many CPUs, at least one."""
        return max(1, cpus) if self.actors == "all" else self.actors


CHANGEABLE = (
    *("model", "latent", "distribution", "head"),
    *("weighting", "kl_weight", "learning_rate", "epoch_updates", "patience"),
)
"""Settings of training that belong to the preset unless they are given."""


class TrainSettings(Section):
    """`svaedc train`: where and for how long; what is trained is the preset's business."""

    workers: PositiveInt = 1
    """Data-parallel training processes."""
    least_workers: PositiveInt | Literal["all"] = "all"
    """With fewer than `workers`, training starts and goes on with as many as there is room for."""
    threads: PositiveInt | Literal["all"] = "all"
    """Of each process, one CPU each; `all` shares the free CPUs among the processes, each on one machine."""
    updates: PositiveInt | Literal["preset"] = "preset"
    """Gradient updates of each stage; fewer train faster and worse."""
    stride: PositiveInt | Literal["preset"] = "preset"
    """Every how many control steps the model sees one; 5 in the preset `compact`, 1 in `paper`."""
    time_limit_seconds: PositiveFloat = inf
    """Training stops after the epoch in which this passes."""
    cache_folder: UserPath = Path("~/.cache/svaedc").expanduser()
    """Where shards are decoded into one memory-mapped array, once per dataset."""
    checkpoint_every_epochs: PositiveInt = 1
    """Epochs that an interruption may cost."""
    device: Literal["auto", "cpu", "cuda"] = "auto"
    """`auto` takes a GPU for each process where the cluster has any; `cuda` refuses to do without."""
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """Of matrix products; `auto` is bfloat16 on a GPU that has it, and float32 elsewhere."""
    moments: NonNegativeInt = 10
    """Pictures of each trajectory in the clip of the trained model's motions; 0 for no clip and no stills."""
    balance: Literal["none", "y", "f"] = "none"
    """Show episodes of every tenth of the range of y or f equally often; for skewed data."""
    model: Literal["preset", "svae-dc", "svae"] = "preset"
    """`svae` knows nothing of badness."""
    latent: Literal["preset", "3x3", "5x6", "15x12"] = "preset"
    """Steps of the latent path x dimensions of each, with the hidden sizes the paper gives them."""
    distribution: Literal["preset", "laplace", "gaussian"] = "preset"
    """Family of all four distributions."""
    head: Literal["preset", "low-rank", "dense"] = "preset"
    """Output of p(xi|tau)."""
    weighting: Literal["preset", "paper", "hybrid", "balanced"] = "preset"
    """Weights of the bound's terms: the paper's; with generation from x; and with more weight on y too."""
    kl_weight: NonNegativeFloat | Literal["preset"] = "preset"
    """Of the KL term; 1 is the paper's equation."""
    learning_rate: PositiveFloat | Literal["preset"] = "preset"
    """Of the first update of the joint stage."""
    epoch_updates: PositiveInt | Literal["preset"] = "preset"
    """Updates between two measures on held-out episodes, an epoch here whatever the dataset's size."""
    patience: PositiveInt | Literal["preset"] = "preset"
    """Epochs without a better held-out loss after which a stage ends early."""

    def stride_or(self, usual: int) -> int:
        """The stride, which is the preset's usual one unless it is given."""
        return usual if self.stride == "preset" else self.stride

    def changes(self) -> dict[str, str | float | int]:
        """What is changed of the preset, by name."""
        return {name: getattr(self, name) for name in CHANGEABLE if getattr(self, name) != "preset"}


class CompareSettings(Section):
    """`svaedc compare`: the simulated BO runs."""

    slots: PositiveInt = 2
    """Runs at the same time, one CPU each."""
    pool_size: PositiveInt = 5000
    """Candidate controllers drawn afresh for every run."""
    initial_trials: PositiveInt = 2
    """Random trials before the first suggestion; all methods of a seed share them."""


class HardwareSettings(Section):
    """`svaedc hardware`: campaigns on the one robot."""

    pool_size: PositiveInt = 5000
    """Candidate controllers drawn for a campaign; part of its identity."""
    namespace: str = Field(default="svaedc", min_length=1)
    """Ray namespace of the one hardware actor; the same for everybody who shares the robot."""


class TrackingSettings(Section):
    """Where MLflow keeps the runs."""

    uri: str = Field(default="sqlite:///mlflow.db", min_length=1)
    """`sqlite:///FILE` (relative to the working directory) or the address of an MLflow server."""
    experiment: str = Field(default="svaedc", min_length=1)
    """The MLflow experiment that holds the runs."""


class Settings(Section):
    """Everything that can be set; each driver receives its section."""

    ray: RaySettings = RaySettings()
    collect: CollectSettings = CollectSettings()
    train: TrainSettings = TrainSettings()
    compare: CompareSettings = CompareSettings()
    hardware: HardwareSettings = HardwareSettings()
    tracking: TrackingSettings = TrackingSettings()
