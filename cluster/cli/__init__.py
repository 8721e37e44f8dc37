"""The command line: one module for each group of commands."""

from cluster.runtime.shadows import require_own_packages

require_own_packages()
