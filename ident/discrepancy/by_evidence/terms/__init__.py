"""A term, as a formula with units, for what the vocabulary has no name for."""
