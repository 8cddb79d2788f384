"""What is unusual in an air path, its valves' times or its pressure drives: warnings."""

import functools
import math
from collections.abc import Callable, Iterator

import numpy as np

from afo_sim.common import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    STANDARD_DENSITY,
    InputError,
    JsonMapping,
    Keywords,
    Notice,
    in_unit,
)
from afo_sim.description import (
    AMBIENT,
    PARTS,
    SUPPLY,
    Drive,
    Orthosis,
    Scenario,
    Valve,
    amount,
    highest_pressures,
    reached,
    ways,
)
from afo_sim.model.air_path import least_volume, shortest_pulse
from afo_sim.model.walk import stride_time_of

ALIKE = 1.0 - 1e-9
LONG_TUBE = 5.0  # [m]


def check_air_path(scenario: Scenario) -> list[Notice]:
    """Warnings of the air path of a scenario: what air is lost by, what never opens, what has too much."""
    orthosis = scenario.orthosis
    if not orthosis.chamber:
        return []
    lost, long = _of_device(orthosis)
    return [*lost, *_pressures(scenario), *long, *_times(scenario)]


@functools.lru_cache(maxsize=4)  # cases of a sweep share them
def _of_device(orthosis: Orthosis) -> tuple[tuple[Notice, ...], tuple[Notice, ...]]:
    tubes = [(f"chamber {k!r}", c.tube, c.tube_length) for k, c in orthosis.chamber.items()]
    tubes += [(f"restriction {k!r}", r.tube, r.length) for k, r in orthosis.restriction.items()]
    long = []
    for where, tube, length in tubes:
        if tube is not None and length is not None and length > LONG_TUBE:
            text = (
                "the tube of {subject} is {length:.3g} m long: its delay of {delay} (sound, 2.9 ms/m) is not "
            )
            text += "simulated; tubes are tested up to 2 m"
            data: Keywords = {"length": length, "delay": _ms(tube.delay(length))}
            long.append(Notice("tube-long", text, subject=where, **data))
    return tuple(_lost(orthosis)), tuple(long)


def _lost(orthosis: Orthosis) -> Iterator[Notice]:
    """Air that is lost: from the supply all the time, past inlet valves, into volumes that never vent."""
    known = list(ways(orthosis))
    lost = reached([SUPPLY], [way for way in known if way.part.blows_off]).get(AMBIENT)
    if lost:
        through = ", ".join(way.key.partition(".")[2] for way in lost)
        text = "air escapes all the time, from the supply through {through}; put a valve in between"
        yield Notice("air-blows-off", text, through=through)
    fed = reached([SUPPLY], [way for way in known if way.part.feeds])
    for name in orthosis.chamber:
        if name in fed:
            through = ", ".join(repr(way.key.partition(".")[2]) for way in fed[name])
            mend = "a valve between, or another upstream, would stop it"
            if fed[name][-1].part is PARTS["quick_exhaust"]:
                mend = f"chamber.{name}.quick_exhaust would stand behind the inlet"
            text = "chamber {subject!r} is always connected to the supply: its inlet valve is bypassed by "
            text += "restriction {through}; {mend}"
            yield Notice("inlet-bypassed", text, subject=name, through=through, mend=mend)
    out = reached([AMBIENT], known, back=True)
    for name in orthosis.volume:
        if name not in out:
            text = "volume {subject!r} fills and never vents: nothing takes air from it"
            yield Notice("volume-never-vents", text, subject=name)


def valves_of(orthosis: Orthosis) -> Iterator[tuple[str, Valve, str]]:
    """(name, valve, node before it) of all valves that are described."""
    for name, chamber in orthosis.chamber.items():
        yield f"{name}_inlet", chamber.inlet, chamber.feed
        if chamber.outlet is not None:
            yield f"{name}_outlet", chamber.outlet, name
    for name, each in orthosis.restriction.items():
        if each.valve is not None:
            yield name, each.valve, each.upstream


def _pressures(scenario: Scenario) -> Iterator[Notice]:
    """Valves that get another pressure than their maker allows, volumes that begin above the supply's."""
    highest = highest_pressures(scenario.orthosis, scenario.supply.pressure)
    for name, valve, before in valves_of(scenario.orthosis):
        if valve.working_pressure is None:
            continue
        (low, high), pressure = valve.working_pressure, highest.get(before, 0.0)
        has = "valve {subject} ({valve}) has {shown} before it, "
        data: Keywords = {
            "low": low,
            "high": high,
            "valve": valve.name or "unnamed",
            "shown": amount(pressure, "Pa", 3),
            "pressure": pressure,
        }
        if pressure > high * (1.0 + 1e-9):
            text = has + "but its maker allows only {allowed}"
            allowed = amount(high, "Pa", 3)
            yield Notice("valve-pressure-high", text, subject=name, allowed=allowed, **data)
        elif pressure < low * ALIKE:
            text = has + "but needs {needed}: it is simulated as if it switched; take another valve, or "
            text += "more pressure"
            needed = amount(low, "Pa", 3)
            yield Notice("valve-pressure-low", text, subject=name, needed=needed, **data)

    most, fed = scenario.supply.pressure, reached([SUPPLY], ways(scenario.orthosis))
    for name, each in scenario.orthosis.volume.items():
        if name in fed and (each.start_pressure or 0.0) > most * (1.0 + 1e-9):
            text = (
                "volume {subject!r} starts with {start}, more than the supply's {supply}: use start_pressure "
            )
            text += "only for a volume that was filled beforehand"
            start, supply = amount(each.start_pressure or 0.0, "Pa", 3), amount(most, "Pa", 3)
            yield Notice("volume-above-supply", text, subject=name, start=start, supply=supply)


def _times(scenario: Scenario) -> Iterator[Notice]:
    """Valves between nodes that nothing opens, and pulses too short for their valve."""
    timing = scenario.timer or scenario.phases
    told = timing.chambers if timing is not None else {}
    for name, each in scenario.orthosis.restriction.items():
        if each.valve is not None and not (name in told and told[name].open):
            table = "phases" if scenario.phases is not None else "timer"
            text = "valve {subject!r} never opens: set {table}.{subject}.open"
            yield Notice("valve-never-opens", text, subject=name, table=table)
    valves = {name: valve for name, valve, _ in valves_of(scenario.orthosis)}
    for name, seconds in _shortest(scenario).items():
        if name in valves and (text := too_short(name, valves[name], seconds)):
            yield Notice("pulse-short", "{text}", subject=name, text=text, seconds=seconds)


def too_short(name: str, valve: Valve, seconds: float) -> str:
    """What comes of a pulse of a coil [s] that is too short for its valve; "" where it is long enough."""
    pulse, delay = f"valve {name}: a pulse of {_ms(seconds)}", valve.opening_delay
    if seconds < delay * ALIKE:
        return f"{pulse} is shorter than its opening delay, {_ms(delay)}: it does not open"
    if valve.minimum_on_time is not None and seconds < valve.minimum_on_time * ALIKE:
        least = _ms(valve.minimum_on_time)
        return f"{pulse} is shorter than its minimum_on_time, {least}: here it opens, a real one may not"
    return ""


def _ms(seconds: float) -> str:
    return f"{in_unit(seconds, 's', 'ms'):.3g} ms"


def _shortest(scenario: Scenario) -> dict[str, float]:
    """The shortest pulse of every valve that times are told of [s]; by phase as of the mean stride."""
    controller = scenario.controller
    clock = scenario.timer or (controller.timer if controller is not None else None)
    found: dict[str, float] = {}
    tables: JsonMapping
    if controller is not None and controller.pid is not None and controller.pid.pressures is None:
        named, period = controller.pid.named.values(), 1.0 / controller.rate
        return {f"{name}_{side}": period for name in named for side in ("inlet", "outlet")}
    if clock is not None:
        period, unit, tables = clock.period, 1.0, clock.chambers
    elif scenario.phases is not None:
        period, unit, tables = 1.0, stride_time_of(scenario), scenario.phases.chambers
    else:
        return found
    for name, times in tables.items():
        for side in ("inlet", "outlet") if name in scenario.orthosis.chamber else ("open",):
            spans = durations(getattr(times, side), period)
            if spans:
                found[name if side == "open" else f"{name}_{side}"] = unit * min(spans)
    return found


def durations(intervals: tuple[tuple[float, float], ...], period: float) -> list[float]:
    """Durations of intervals that repeat with a period, those that touch as one; none of a coil always on."""
    parts = sorted(p for a, b in intervals for p in ([(a, b)] if a < b else [(a, period), (0.0, b)]))
    merged: list[list[float]] = []
    for start, end in parts:
        if merged and start <= merged[-1][1] + 1e-12 * period:
            merged[-1][1] = max(merged[-1][1], end)
        else:
            merged.append([start, end])
    if len(merged) > 1 and merged[0][0] <= 0.0 and merged[-1][1] >= period * ALIKE:
        first = merged.pop(0)
        merged[-1][1] += first[1]
    elif merged and merged[0][0] <= 0.0 and merged[0][1] >= period * ALIKE:
        return []
    return [end - start for start, end in merged if end > start]


SAMPLED = 2.0  # rate × period beyond which an integrator that is corrected once a period swings
FINE = 64.0  # a step by so much shorter is taken for continuous
HALVINGS = 40  # of a search for what would do


def check_drives(scenario: Scenario) -> tuple[dict[str, float], list[str]]:
    """Rate × time step of the drives' loops, and warnings; refuse a pulse train faster than the step."""
    numbers, warnings = [], []
    for name, drive in scenario.drive.items():
        rate = fastest_rise(scenario.orthosis, name, scenario.supply.pressure)
        if drive.kind == "pwm" and drive.period < scenario.timestep * (1.0 - 1e-9):
            own, step = (f"{in_unit(time, 's', 'ms'):g} ms" for time in (drive.period, scenario.timestep))
            problem, allowed = "is shorter than the time step", f"at least {step}, or a shorter timestep"
            raise InputError(problem, field=f"drive.{name}.period", value=own, allowed=allowed)
        idle = f"{', '.join(drive.idle)} changes nothing in a drive of kind {drive.kind}"
        said = [idle] if drive.idle else []
        chamber = scenario.orthosis.chamber[name]
        shortest = drive.shortest_pulse(shortest_pulse(chamber))
        if drive.kind != "regulator" and not (drive.least_on is None and shortest < drive.period):
            for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.outlet)):
                short = "" if valve is None else too_short(f"{name}_{side}", valve, shortest)
                said += [short] if short else []
        said += CHECKS[drive.kind](drive, rate, scenario, name)
        warnings += [f"drive of chamber {name!r}: {text}" for text in said]
        if drive.kind != "bang_bang":
            numbers.append(scenario.timestep * rate / drive.full_at)
    return ({"drive": max(numbers)} if numbers else {}), warnings


def fastest_rise(orthosis: Orthosis, chamber: str, supply: float) -> float:
    """The fastest rate of a chamber's pressure through a fully open valve [Pa/s]."""
    described = orthosis.chamber[chamber]
    conductance = max(described.inlet.conductance, described.vent.conductance)
    flow = conductance * STANDARD_DENSITY * (supply + AMBIENT_PRESSURE)
    stiff = HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE
    return stiff * flow / least_volume(orthosis, chamber)


def _bang_bang(drive: Drive, rate: float, scenario: Scenario, name: str) -> Iterator[str]:
    """An open valve moves the pressure on until it is shut; it must not come to where the other opens."""
    chamber = scenario.orthosis.chamber[name]
    shuts = max(valve.closing_delay + valve.closing_ramp for valve in (chamber.inlet, chamber.vent))
    late = shuts + scenario.timestep  # it is looked at once a step
    swing = rate * (late + drive.filter_time)
    if swing > drive.dead_band + drive.releases_at:
        share = 1.0 + (drive.releases_at / drive.dead_band if drive.dead_band > 0.0 else 0.0)
        yield (
            f"while an open valve shuts, the pressure may move on by {1e-5 * swing:.2g} bar, so that the "
            f"other valve opens again and again; a dead_band of {1e-5 * swing / share:.2g} bar would do"
        )


def _pwm(drive: Drive, rate: float, scenario: Scenario, name: str) -> Iterator[str]:
    chamber = scenario.orthosis.chamber[name]
    opening = max(chamber.inlet.opening_delay, chamber.vent.opening_delay)
    if drive.period <= opening:
        yield (
            f"its period is not longer than the valves' opening delay, {in_unit(opening, 's', 'ms'):g} ms: "
            "no pulse opens them"
        )
    swings = rate * drive.period / drive.full_at
    if swings > SAMPLED:
        yield (
            "the pressure may swing from pulse to pulse: its period is too long for this valve and full_at; "
            f"{in_unit(drive.period * SAMPLED / swings, 's', 'ms'):.2g} ms, or a full_at of "
            f"{1e-5 * drive.full_at * swings / SAMPLED:.2g} bar would do"
        )
    # the output of one period moves that of the next by −T_d ṗ/e_full of itself: beyond 1 that grows
    seen = 1.0 if drive.filter_time <= 0.0 else -math.expm1(-drive.period / drive.filter_time)
    kick = seen * rate * drive.derivative_time / drive.full_at
    if kick > 1.0:
        yield (
            "the pressure may swing from pulse to pulse: its derivative alone makes of each pulse a longer "
            "one of the other valve; a derivative_time of "
            f"{in_unit(drive.derivative_time / kick, 's', 'ms'):.2g} ms would do"
        )


def _regulator(drive: Drive, rate: float, scenario: Scenario, name: str) -> Iterator[str]:
    step = scenario.timestep
    if _damped(drive, rate, step):
        return
    gentle = _most(lambda factor: _damped(drive, rate / factor, step))
    text = f"the pressure may swing; a full_at of {1e-5 * drive.full_at * gentle:.2g} bar would do"
    if _damped(drive, rate, step / FINE):
        enough = step / _most(lambda factor: _damped(drive, rate, step / factor))
        text += f", or a timestep of {in_unit(enough, 's', 'ms'):.2g} ms"
    yield text


CHECKS = {"bang_bang": _bang_bang, "pwm": _pwm, "regulator": _regulator}


def _most(good: Callable[[float], bool]) -> float:
    """The least factor from 1 on that is good, where larger ones are good too."""
    low, high = 1.0, 2.0
    while not good(high) and high < 1e9:
        low, high = high, 2.0 * high
    for _ in range(HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if good(middle) else (middle, high)
    return high


def _damped(drive: Drive, rate: float, step: float) -> bool:
    """Whether the loop of PID, transducer, proportional valve and chamber comes to rest by itself."""
    gain, valve = step * rate / drive.full_at, -math.expm1(-2.0 * math.pi * drive.bandwidth * step)
    low = 1.0 if drive.filter_time <= 0.0 else -math.expm1(-step / drive.filter_time)
    # rows and columns: p, y, o, I
    reading = np.array([low, 1.0 - low, 0.0, 0.0])
    change = reading - np.array([0.0, 1.0, 0.0, 0.0])
    kept = np.array([0.0, 0.0, 0.0, 1.0])
    integral = kept if drive.integral_time is None else kept - step / drive.integral_time * reading
    output = integral - reading - drive.derivative_time / step * change
    pressure = np.array([1.0, 0.0, gain, 0.0])
    opening = np.array([0.0, 0.0, 1.0 - valve, 0.0]) + valve * output
    matrix = np.array([pressure, reading, opening, integral])
    if drive.integral_time is None:
        matrix = matrix[:3, :3]
    return bool(np.abs(np.linalg.eigvals(matrix)).max() <= 1.0 + 1e-9)
