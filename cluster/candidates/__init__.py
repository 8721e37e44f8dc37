"""`svaedc candidates`: controllers that are simulated many times before any of them is tried."""
