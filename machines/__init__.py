"""The machine: declaration, checks, executive, mirror; the tasks' machines as data."""
