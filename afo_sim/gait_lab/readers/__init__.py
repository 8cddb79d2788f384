"""Walking data as laboratories write it: OpenSim models and tables, .trc, .c3d, CSV → tables, unread."""
