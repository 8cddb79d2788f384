"""The sensors' kernel as machine code: addresses of six arrays, four whole numbers, the time step."""

from afo_sim.physics import kernels, sense

compiled_sense = kernels("sensing", sense)
