"""Files of gait laboratories become a stride: readers of their formats, and what a trial holds."""
