"""Pictures and clips of episodes."""
