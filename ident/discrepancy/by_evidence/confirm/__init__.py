"""Whether what was found holds on recordings that were not fitted."""
