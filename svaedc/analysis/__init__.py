"""What many runs say: estimates, tests, summaries, evidence."""
