"""Recording → Rerun: one file, made by replay in columns, with its layout inside."""

from afo_sim.show.rerun.recording_file import write_comparison as write_comparison
from afo_sim.show.rerun.recording_file import write_rrd as write_rrd
from afo_sim.show.rerun.run_rows import require_time as require_time
from afo_sim.show.rerun.viewer import open_recordings as open_recordings
from afo_sim.show.rerun.viewer import screenshot as screenshot
