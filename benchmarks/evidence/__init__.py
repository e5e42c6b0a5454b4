"""The search by evidence on logs that are not of the simulated bench."""
