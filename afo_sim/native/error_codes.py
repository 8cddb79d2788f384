"""Complaints of the callbacks; the text that MuJoCo reports is "<complaint> <actuator id>"."""

COMPLAINTS = (
    "the force is not a number in actuator",
    "the absolute pressure is not positive in actuator",
    "the volume is not positive in actuator",
    "the air mass is not positive in actuator",
    "the supply's absolute pressure is not positive in actuator",
    "no length of its muscles balances their forces in actuator",
    "afo_sim's parameters are missing (of an older run, whose model.xml has none, take "
    "afo_sim.read_recording(folder).model()) in actuator",
    "the callback has raised an exception in actuator",
    "the pressure that is asked for is not a number in actuator",
)
(
    NO_NUMBER, NO_PRESSURE, NO_VOLUME, NO_AIR, NO_SUPPLY, NO_LENGTH, NO_MARK, RAISED, NO_TARGET,
) = range(len(COMPLAINTS))  # fmt: skip
FINE = -1
MJU_ERROR = "afo_sim_mju_error"  # symbol of MuJoCo's `mju_error`, by which compiled code complains
