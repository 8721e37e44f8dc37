"""What is kept of a campaign beside its journal, and what is made of it for people and programs."""
