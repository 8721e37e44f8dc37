"""`python -m cluster` is `svaedc`."""

from cluster.cli import main

main()
