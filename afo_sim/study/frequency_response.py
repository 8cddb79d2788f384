"""Frequency response of a device at a given amplitude: `afo_sim.bode`."""

import math
import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import InputError, Shown, parse_quantity, unknown
from afo_sim.description import MAX_STEPS, Scenario, load
from afo_sim.simulation import column_at, describe
from afo_sim.simulation.simulate import simulate
from afo_sim.study.excitation import WHATS, Excitation, OnPressure, OnReference, OnValves, chamber_of
from afo_sim.study.folder import write_answer
from afo_sim.study.frequency_curve import Curve, Harmonic, first_harmonic, unwrapped

Report = Callable[[int, int, str], None]
Draw = Callable[["FrequencyResponse", pathlib.Path], None]
FREQUENCIES = (0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0)  # [Hz]
_PERIODS = 8  # that are run at least; half of them settle, half are analysed
_SHORTEST = 8.0  # [s]
_DOUBLINGS = 3  # of the periods, where the first harmonic has not settled
_SETTLED = 0.01  # change of the first harmonic between the halves of what is analysed [-]
_PRESSURE_AMPLITUDE = 5e4  # by default [Pa]
Quantity = float | str | None


@dataclass(frozen=True, eq=False, repr=False)
class FrequencyResponse(Shown):
    """Responses of a device to one excitation over frequency.

    what : "reference", "pressure" or "valves"
    amplitude, mean : of the input [input_unit]; of valves 1 and 0
    chamber : that is excited; "" of a reference
    input_unit : SI unit of the input
    curves : by output column
    scenario : resolved, as it was excited
    periods : that were run at each frequency
    """

    what: str
    amplitude: float
    mean: float
    chamber: str
    input_unit: str
    curves: dict[str, Curve]
    scenario: dict[str, Any]
    periods: tuple[int, ...]

    def __getitem__(self, output: str) -> Curve:
        if output not in self.curves:
            raise unknown(output, self.curves, field="output", problem="was not analysed")
        return self.curves[output]

    def __repr__(self) -> str:
        curves = "; ".join(f"{name} −3 dB {c.bandwidth}, −90° {c.quarter}" for name, c in self.curves.items())
        return f"<FrequencyResponse of {self.scenario['name']!r} to {self.what}: {curves}>"

    def to_json(self) -> dict[str, Any]:
        """Contents of bode.json."""
        return {
            "what": self.what,
            "amplitude": self.amplitude,
            "mean": self.mean,
            "chamber": self.chamber,
            "input_unit": self.input_unit,
            "periods": list(self.periods),
            "settled": _SETTLED,
            "curves": [curve.to_json() for curve in self.curves.values()],
            "scenario": self.scenario,
        }

    def csv(self) -> str:
        """Contents of bode.csv: a row for each output and frequency."""
        lines = ["output,frequency [Hz],gain [SI],gain,gain unit,gain [dB],phase [deg],distortion,mean [SI]"]
        for name, c in self.curves.items():
            for k, frequency in enumerate(c.frequency):
                numbers = (f"{frequency:.6g}", f"{c.gain[k]:.6g}", f"{c.shown_gain[k]:.6g}")
                more = (c.decibel[k], math.degrees(c.phase[k]), c.distortion[k], c.mean[k])
                lines.append(",".join([name, *numbers, c.gain_unit, *(f"{value:.6g}" for value in more)]))
        return "\n".join(lines) + "\n"

    @property
    def tolerance(self) -> float:
        """Change of a first harmonic up to which it counts as settled [-]."""
        return _SETTLED

    def save(self, folder: str | os.PathLike[str], draw: Draw | None = None) -> pathlib.Path:
        """Write bode.csv and bode.json, and bode.png if `draw` is given; together or not at all.

        Parameters
        ----------
        folder : made if need be
        draw : called with this response and the path of the figure

        Returns
        -------
        the folder
        """
        return write_answer(pathlib.Path(folder), "bode", self, draw)


def bode(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    sets: Mapping[str, Any] | None = None,
    *,
    what: str | None = None,
    amplitude: Quantity = None,
    mean: Quantity = None,
    chamber: str | None = None,
    frequencies: Sequence[float] = FREQUENCIES,
    report: Report | None = None,
) -> FrequencyResponse:
    """Frequency response of a seated device at a given amplitude, from runs: first harmonic over input.

    Each frequency is run from rest until the first harmonic repeats; a valve's flow is far from linear, so
    that another amplitude has another response.

    Parameters
    ----------
    scenario : a shipped name, a path, a dict of the same shape, or a Scenario; without walking
    sets : dotted keys and values laid over it
    what : "reference", a sine on what the controller is asked for; "pressure", a sine on what a chamber's
        drive is asked for; "valves", inlet and outlet in turn, half a period each. By default the first of
        them that the scenario has
    amplitude : of the sine, half of its peak to peak: "5 deg", or in SI; by default the reference's own, of
        a pressure 0.5 bar
    mean : about which it goes: "2 bar", or in SI; by default the reference's own, of a pressure half of the
        supply's
    chamber : that is excited; the orthosis' first by default
    frequencies : rising [Hz] (n,); each is moved to the nearest whose half period is whole control periods
    report : called with (done, in all, what)

    Returns
    -------
    FrequencyResponse

    Raises
    ------
    InputError
        The description is wrong or walks, or there is nothing of what is asked for.
    SimulationError
        A run fails.

    Examples
    --------
    >>> found = bode("seated", what="valves", frequencies=[0.5, 1, 2])
    >>> pressure = found["chamber/dorsiflexor/pressure"]
    >>> bool(pressure.gain[0] > pressure.gain[-1]), pressure.gain_unit
    (True, 'bar')
    """
    description = scenario if isinstance(scenario, Scenario) else load("scenario", scenario)
    description = description.set(sets) if sets else description
    return _response(description, excited(description, what, amplitude, mean, chamber), frequencies, report)


def _response(
    description: Scenario, excitation: Excitation, frequencies: Sequence[float], report: Report | None
) -> FrequencyResponse:
    """The response to an excitation, frequency by frequency."""
    rounded = _rounded(excitation, description.timestep, frequencies)
    found = []
    for k, frequency in enumerate(rounded):
        if report is not None:
            report(k, len(rounded), f"{frequency:.3g} Hz")
        found.append(_settled(excitation, frequency, description.timestep))
    curves = {
        name: _curve(name, excitation, rounded, [harmonics[name] for harmonics, _ in found])
        for name in excitation.outputs
    }
    return FrequencyResponse(
        what=excitation.what,
        amplitude=getattr(excitation, "amplitude", 1.0),
        mean=getattr(excitation, "mean", 0.0),
        chamber=getattr(excitation, "chamber", ""),
        input_unit=excitation.unit,
        curves=curves,
        scenario=description.resolved(),
        periods=tuple(periods for _, periods in found),
    )


def excited(
    scenario: Scenario, what: str | None, amplitude: Quantity, mean: Quantity, chamber: str | None
) -> Excitation:
    """The excitation that is asked for, as `bode` takes it; InputError where the scenario has none of it."""
    if scenario.walking:
        problem = "walks: its own strides would stand in every response"
        raise InputError(problem, field="scenario", value=scenario.name, allowed="a scenario that sits")
    controller = scenario.controller
    follows = controller is not None and bool(controller.pid or controller.impedance)
    name = chamber_of(scenario, chamber)
    what = what or ("reference" if follows else "pressure" if name in scenario.drive else "valves")
    if what not in WHATS:
        raise unknown(what, WHATS, field="what")
    if what == "reference":
        return _on_reference(scenario, amplitude, mean, chamber)
    if what == "pressure":
        return _on_pressure(scenario, name, amplitude, mean)
    for field, value in (("amplitude", amplitude), ("mean", mean)):
        if value is not None:
            problem = "does not go with valves, which are open or shut"
            raise InputError(problem, field=field, value=value, allowed="nothing")
    return OnValves(scenario, name)


def _on_reference(
    scenario: Scenario, amplitude: Quantity, mean: Quantity, chamber: str | None
) -> OnReference:
    if chamber is not None:
        problem = "does not go with a reference: the controller commands its own chambers"
        raise InputError(problem, field="chamber", value=chamber, allowed="nothing")
    it = OnReference(scenario, 0.0, 0.0)
    described = it.described
    own = described.loop.reference if hasattr(described, "loop") else described.reference
    size = own.amplitude if amplitude is None else _read(amplitude, it.unit, "amplitude")
    middle = own.mean if mean is None else _read(mean, it.unit, "mean")
    if size <= 0.0:
        problem = "is not above zero" if amplitude is not None else "is missing: the reference has none"
        raise InputError(problem, field="amplitude", value=amplitude, allowed='such as "5 deg"')
    own.with_values(mean=middle, amplitude=size, table=(), column=None)  # refused here if out of range
    return OnReference(scenario, middle, size)


def _on_pressure(scenario: Scenario, chamber: str, amplitude: Quantity, mean: Quantity) -> OnPressure:
    if chamber not in scenario.drive:
        problem = "has no drive that follows a pressure"
        raise InputError(problem, field="chamber", value=chamber, allowed=f"a table [drive.{chamber}]")
    size = _PRESSURE_AMPLITUDE if amplitude is None else _read(amplitude, "Pa", "amplitude")
    middle = 0.5 * scenario.supply.pressure if mean is None else _read(mean, "Pa", "mean")
    if not 0.0 < size <= middle or middle + size > scenario.supply.pressure:
        problem = "goes beyond what can be asked for"
        allowed = f"above 0 and, about {middle:g} Pa, from 0 to the supply's {scenario.supply.pressure:g} Pa"
        raise InputError(problem, field="amplitude", value=f"{size:g} Pa", allowed=allowed)
    return OnPressure(scenario, chamber, middle, size)


def _read(value: float | str, unit: str, field: str) -> float:
    """A number in SI, or a text with its unit."""
    try:
        return parse_quantity(value if isinstance(value, str) else f"{float(value)!r} {unit}", unit)
    except (TypeError, ValueError) as error:
        raise InputError(str(error), field=field, value=value) from None


def _rounded(excitation: Excitation, timestep: float, frequencies: Sequence[float]) -> np.ndarray:
    """Frequencies whose half period is a whole number of control periods, rising [Hz] (n,)."""
    try:
        wanted = np.array(frequencies, float).ravel()
    except (TypeError, ValueError):
        wanted = np.array([])
    tick = excitation.tick * timestep
    lowest, highest = 2.0 * _PERIODS / (MAX_STEPS * timestep), 0.125 / tick
    fine = (
        len(wanted) and np.isfinite(wanted).all() and (wanted >= lowest).all() and (wanted <= highest).all()
    )
    if not fine or (np.diff(wanted) <= 0.0).any():
        problem = "are not rising frequencies that can be run"
        allowed = f"rising numbers from {lowest:.2g} to {highest:g} Hz, an eighth of the control rate"
        raise InputError(problem, field="frequencies", value=frequencies, allowed=allowed)
    halves = np.maximum(np.round(0.5 / (wanted * tick)), 1.0)
    found: np.ndarray = np.unique(0.5 / (halves * tick))
    return found


def _settled(
    excitation: Excitation, frequency: float, timestep: float
) -> tuple[dict[str, tuple[Harmonic, float]], int]:
    """(First harmonic and how much it still changes, of each output; periods that were run)."""
    periods = _PERIODS * 2 ** max(math.ceil(math.log2(_SHORTEST * frequency / _PERIODS)), 0)
    for doubling in range(_DOUBLINGS + 1):
        count = round(periods / (frequency * timestep))
        if count > MAX_STEPS:
            break
        found = _analysed(excitation, frequency, count)
        if all(change <= _SETTLED for _, change in found.values()) or doubling == _DOUBLINGS:
            break
        periods *= 2
    return found, periods


def _analysed(excitation: Excitation, frequency: float, count: int) -> dict[str, tuple[Harmonic, float]]:
    """One run of a number of steps: first harmonic of its second half, and that half's own change."""
    built, policy = excitation.begun(frequency, count)
    rollout = simulate(built, policy, n_step=count)
    if rollout.failure is not None:
        raise rollout.failure
    found = {}
    for name in excitation.outputs:
        time, signal = (column_at(built, of, rollout.rows, rollout.control, 0) for of in ("time", name))
        found[name] = settled_harmonic(time, signal, frequency)
    return found


def settled_harmonic(time: np.ndarray, signal: np.ndarray, frequency: float) -> tuple[Harmonic, float]:
    """First harmonic of a signal's second half, and the share by which it changes within that half."""
    n = len(time)
    parts = (slice(n // 2, 3 * n // 4), slice(3 * n // 4, n))
    before, after = (first_harmonic(time[part], signal[part], frequency).phasor for part in parts)
    change = abs(after - before) / abs(after) if after else math.inf
    return first_harmonic(time[n // 2 :], signal[n // 2 :], frequency), change


def _curve(
    name: str, excitation: Excitation, frequencies: np.ndarray, found: Sequence[tuple[Harmonic, float]]
) -> Curve:
    ratio = np.array([harmonic.phasor for harmonic, _ in found]) / excitation.phasor
    return Curve(
        output=name,
        unit=describe(name)[0],
        input_unit=excitation.unit,
        frequency=frequencies,
        gain=np.abs(ratio),
        phase=unwrapped(np.angle(ratio)),
        distortion=np.array([harmonic.distortion for harmonic, _ in found]),
        mean=np.array([harmonic.mean for harmonic, _ in found]),
        unsettled=np.array([change for _, change in found]),
    )
