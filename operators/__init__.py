"""Synthetic operators: roles, attention, belief, timing, policies."""
