"""Electronics as they are described: sensors, controllers, drives."""
