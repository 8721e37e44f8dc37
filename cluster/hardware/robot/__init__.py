"""The robot beside its campaigns: its home, its limits, and its stop."""
