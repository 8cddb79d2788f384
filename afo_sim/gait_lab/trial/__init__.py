"""A walking trial: what its files mean, from markers, models and plates to strides and a gait cycle."""
