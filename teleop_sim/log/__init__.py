"""The log: records to MCAP and back."""
