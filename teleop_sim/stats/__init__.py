"""What many runs say: pure functions from a table of runs to estimates with intervals. No simulator here."""
