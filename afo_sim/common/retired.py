"""Names of the library and commands that are no more, and what to use instead."""

RETIRED = {
    "bode": "a sweep over the frequency of the controller's reference",
    "pressure_map": "`afo-sim torque-map`; an impedance is a controller of three lines, docs/controllers.md",
}
