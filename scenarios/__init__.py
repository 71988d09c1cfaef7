"""Scenarios: files, their schema, randomisation, names to objects."""
