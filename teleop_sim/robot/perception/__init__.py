"""What the robot sees: sensors by ray casting, and the detectors that work on what they give."""
