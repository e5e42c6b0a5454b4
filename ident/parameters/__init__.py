"""The model that parameters belong to: regressor, base parameters, the model under examination."""
