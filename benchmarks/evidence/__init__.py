"""The search by evidence and the search by rules on the same logs, none of them of the simulated bench."""
