"""The vocabulary on an arm, as columns."""
