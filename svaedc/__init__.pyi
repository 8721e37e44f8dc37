from cluster.api import collect as collect
from cluster.api import compare as compare
from cluster.api import load_setup as load_setup
from cluster.api import method_names as method_names
from cluster.api import open_dataset as open_dataset
from cluster.api import setup_names as setup_names
from cluster.api import simulate_candidates as simulate_candidates
from cluster.api import simulated_robot as simulated_robot
from cluster.api import train as train
from cluster.optimization.models import load_model as load_model
from cluster.optimizer import Optimizer as Optimizer
from svaedc.model.svae_dc import SvaeDc as SvaeDc
from workers.dataset.folder import Dataset as Dataset
from workers.setups.setup import Setup as Setup

__version__: str
