"""The simulation behind other libraries' interfaces: dm_control, Gymnasium and their tasks."""
