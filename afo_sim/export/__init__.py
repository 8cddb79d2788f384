"""Runs as files of other programs: OpenSim, spreadsheets, MATLAB, MuJoCo."""
