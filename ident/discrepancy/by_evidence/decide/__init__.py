"""Which set of effects the data have."""
