"""What is measured: the virtual test stand, fits to measured data, and published tables held against runs."""
