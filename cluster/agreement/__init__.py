"""`svaedc setups compare`: how far two simulations of the same controllers agree."""
