"""The log: one MCAP file a run, written as it happens and read into records or DataFrames."""
