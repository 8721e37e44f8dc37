"""`python -m cluster` is `svaedc`."""

from cluster.cli.main import main

main()
