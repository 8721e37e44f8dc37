"""Ray: a session, the machines of its cluster, pools of actors, and signals."""
