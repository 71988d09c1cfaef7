"""Scenes and stepping; the only importer of mujoco."""
