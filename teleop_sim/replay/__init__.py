"""Runs looked at again: the plant rebuilt from a log, put where the log says, and drawn."""
