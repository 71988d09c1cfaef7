"""What every layer may use: errors, units, named random streams, record types."""
