"""The model of the data and the evidence of a set of effects."""
