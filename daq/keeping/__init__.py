"""Results that are put into the catalogue, made again, compared, pruned."""
