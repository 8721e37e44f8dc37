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
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
)

from cluster.home import cache_folder, expand_home

SQLITE = "sqlite:///"

UserPath = Annotated[Path, AfterValidator(expand_home)]
"""A leading `~` of such a path stands for the user's home."""


def _infinity(text: object) -> object:
    """Without YAML's point, which plain text has as well."""
    return "inf" if text == ".inf" else text


Limit = Annotated[PositiveFloat, BeforeValidator(_infinity)]
"""It may be infinite."""

Part = Literal["dashboard"]
"""A cluster started by a command may do without this: the dashboard, which Ray Train queries all the time."""


class Section(BaseModel):
    """What all sections share: they cannot change, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class RaySettings(Section):
    """A Ray cluster started by the command itself; unused when it joins a running one."""

    num_cpus: PositiveInt | Literal["all"] = "all"
    """The cluster offers so many CPUs; `all` is every CPU this process may use."""
    object_store_memory: int = Field(default=300_000_000, ge=80_000_000)
    """Objects share so many bytes of memory; results here are small, so little is needed."""
    temporary_folder: UserPath = Path("/tmp/ray")
    """Sockets and logs lie here; it is short, because a socket's whole path may have 107 characters."""
    log_file_bytes: int = Field(default=20_000_000, ge=100_000)
    """A process of Ray begins its log anew after so many bytes; the full one before it is kept."""
    connect_timeout_seconds: float = Field(default=5.0, gt=0.0, le=3600.0)
    """A running cluster has so long to accept a connection, at most an hour."""


class CollectSettings(Section):
    """`svaedc collect`: how rollouts are spread over actors."""

    actors: PositiveInt | Literal["all"] = "all"
    """So many processes roll out, one CPU each; `all` is one per CPU of the cluster."""
    episodes_per_shard: PositiveInt = 256
    """One Parquet file has so many rows; this is part of a dataset's identity."""
    storage: Literal["float32", "int16"] = "float32"
    """Trajectories are stored exactly or as codes between their channels' bounds; this is part of a dataset's
    identity."""
    shards_in_flight_per_actor: PositiveInt = 1
    """An actor has so many shards at a time, the one that it rolls out included."""
    attempts_per_shard: PositiveInt = 3
    """A shard is put aside with its error after so many failures."""
    shard_timeout_seconds: PositiveFloat = 1800.0
    """A shard counts as failed after this time, and its actor is replaced."""
    episode_timeout_seconds: PositiveFloat = 120.0
    """An episode that takes longer hangs: it fails alone, and the others of its shard are kept."""

    def actor_count(self, cpus: int) -> int:
        """Rollout actors on a cluster with this many CPUs, at least one."""
        return max(1, cpus) if self.actors == "all" else self.actors


CHANGEABLE = (
    *("model", "latent", "distribution", "head", "prior"),
    *("weighting", "kl_weight", "learning_rate", "epoch_updates", "patience"),
)
"""These settings of training belong to the preset unless they are given."""


class TrainSettings(Section):
    """`svaedc train`: where and for how long; what is trained is the preset's business."""

    workers: PositiveInt = 1
    """So many training processes share the data of every update."""
    least_workers: PositiveInt | Literal["all"] = "all"
    """With fewer than `workers`, training starts and goes on with as many as there is room for."""
    threads: PositiveInt | Literal["all"] = 1
    """Each process has so many threads, one CPU each; `all` shares the free CPUs among the processes, each on
    one machine. A second thread gains next to nothing with these networks, and beside other work it loses."""
    updates: PositiveInt | Literal["preset"] = "preset"
    """Each stage makes so many gradient updates; fewer train faster and worse."""
    stride: PositiveInt | Literal["preset"] = "preset"
    """The model sees one of so many control steps: 5 in the preset `compact`, 1 in `paper`."""
    time_limit_seconds: Limit = inf
    """Training stops after the epoch in which this passes."""
    cache_folder: UserPath = Field(default_factory=cache_folder)
    """Shards are decoded here into one memory-mapped array, once per dataset: in `~/.cache/svaedc`, or, where
    the home is unknown or read-only, in `svaedc-UID` in the folder of temporary files."""
    checkpoint_every_epochs: PositiveInt = 1
    """An interruption may cost so many epochs."""
    device: Literal["auto", "cpu", "cuda"] = "auto"
    """`auto` takes a GPU for each process where the cluster has any; `cuda` refuses to do without."""
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """Matrix products have this precision; `auto` is bfloat16 on a GPU that has it, and float32 elsewhere."""
    moments: NonNegativeInt = 10
    """The clip of the trained model's motions has so many pictures of each trajectory; 0 leaves clip and
    stills out."""
    balance: Literal["none", "y", "f"] = "none"
    """Episodes of every tenth of the range of y or f are shown equally often, for skewed data."""
    model: Literal["preset", "svae-dc", "svae"] = "preset"
    """`svae` knows nothing of badness."""
    latent: Literal["preset", "3x3", "5x6", "15x12"] = "preset"
    """The latent path has so many steps x dimensions of each, with the hidden sizes the paper gives them."""
    distribution: Literal["preset", "laplace", "gaussian"] = "preset"
    """All four distributions are of this family."""
    head: Literal["preset", "low-rank", "dense"] = "preset"
    """p(xi|tau) has this kind of output."""
    prior: Literal["preset", "mlp", "deconv", "plan"] = "preset"
    """p(tau,psi|x) reads x; `plan` reads as a sequence what a controller wants before the world answers, of
    robots whose controllers say so."""
    weighting: Literal["preset", "paper", "hybrid", "balanced"] = "preset"
    """The bound's terms have the paper's weights; `hybrid` adds generation from x, `balanced` more weight on
    y too."""
    kl_weight: NonNegativeFloat | Literal["preset"] = "preset"
    """The KL term has this weight; 1 is the paper's equation."""
    learning_rate: PositiveFloat | Literal["preset"] = "preset"
    """The first update of the joint stage has this learning rate."""
    epoch_updates: PositiveInt | Literal["preset"] = "preset"
    """Two measures on held-out episodes are so many updates apart, an epoch here whatever the dataset's
    size."""
    patience: PositiveInt | Literal["preset"] = "preset"
    """A stage ends early after so many epochs without a better held-out loss."""

    def stride_or(self, usual: int) -> int:
        """The stride, which is the preset's usual one unless it is given."""
        return usual if self.stride == "preset" else self.stride

    def changes(self) -> dict[str, str | float | int]:
        """What is changed of the preset, by name."""
        return {name: getattr(self, name) for name in CHANGEABLE if getattr(self, name) != "preset"}


class CompareSettings(Section):
    """`svaedc compare`: the simulated BO runs."""

    slots: PositiveInt = 2
    """So many runs go on at the same time, one CPU each."""
    pool_size: PositiveInt = 5000
    """So many candidate controllers are drawn afresh for every run."""
    initial_trials: PositiveInt = 2
    """So many random trials come before the first suggestion; all methods of a seed share them."""
    episode_timeout_seconds: PositiveFloat = 120.0
    """A trial that takes longer hangs: it counts as failed, and its run goes on."""


class HardwareSettings(Section):
    """`svaedc hardware`: campaigns on the one robot."""

    pool_size: PositiveInt = 5000
    """So many candidate controllers are drawn for a campaign; this is part of its identity."""
    avoid_distance: float = Field(default=0.05, ge=0.0, le=1.0)
    """No controller is proposed that differs by less than this from one that failed or was rejected: the root
    mean square over parameters, each in parts of its range. This is part of a campaign's identity."""
    simulations: NonNegativeInt = 20
    """What waits for a person's approval is simulated so often for them."""
    clip: Literal["gif", "mp4", "none"] = "gif"
    """The first of these simulations is drawn into such a file."""
    namespace: str = Field(default="svaedc", min_length=1)
    """The one hardware actor is in this Ray namespace, the same for everybody who shares the robot."""


def _store(uri: str) -> str:
    """The same, with the name of its file as the disk knows it."""
    if not uri.startswith(SQLITE):
        return uri
    name = uri.removeprefix(SQLITE)
    if not name or name.endswith("/"):
        raise ValueError(f"{SQLITE}FILE must name a file")
    return f"{SQLITE}{expand_home(Path(name))}"


class TrackingSettings(Section):
    """Where MLflow keeps the runs."""

    uri: Annotated[str, AfterValidator(_store)] = Field(default=f"{SQLITE}mlflow.db", min_length=1)
    """This is `sqlite:///FILE` or the address of an MLflow server. FILE is a path, relative to the working
    directory, in which no character has a meaning of its own."""
    experiment: str = Field(default="svaedc", min_length=1)
    """This MLflow experiment holds the runs."""

    @property
    def file(self) -> Path | None:
        """The SQLite file; None where `uri` is a server's address."""
        return Path(self.uri.removeprefix(SQLITE)) if self.uri.startswith(SQLITE) else None


class Settings(Section):
    """Everything that can be set; each driver receives its section."""

    ray: RaySettings = RaySettings()
    collect: CollectSettings = CollectSettings()
    train: TrainSettings = Field(default_factory=TrainSettings)
    compare: CompareSettings = CompareSettings()
    hardware: HardwareSettings = HardwareSettings()
    tracking: TrackingSettings = TrackingSettings()
