"""Design search: the parameters of an orthosis that serve an objective best within limits."""
