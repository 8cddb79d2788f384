"""The simulation behind other libraries' interfaces: dm_control's Physics and Composer."""
