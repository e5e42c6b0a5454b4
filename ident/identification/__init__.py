"""The identification: prepared rows, estimates, the test, the verdict."""
