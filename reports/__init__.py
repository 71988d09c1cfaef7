"""Timelines and tables; reads logs only."""
