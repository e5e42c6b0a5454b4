"""A session with an arm: opened, driven, ended."""
