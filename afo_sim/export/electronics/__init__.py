"""Electronics: a timer or a state machine as C for a board, and logs of switched valves."""
