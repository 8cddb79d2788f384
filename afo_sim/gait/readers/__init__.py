"""Walking data as laboratories write it: OpenSim .mot and .sto, .trc, .c3d → gait cycles."""
