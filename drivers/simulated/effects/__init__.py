"""What a scenario can add to the plant: one small value object per effect, axes counted from 1."""
