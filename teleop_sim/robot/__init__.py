"""Robots: their data, kinematics, plans, skills, sensors and detectors."""
