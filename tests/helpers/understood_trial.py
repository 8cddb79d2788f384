"""A stand-in for what `gait import` has understood: known strides of both legs, seen by every means."""

import dataclasses
import pathlib
from types import SimpleNamespace
from typing import Any

import numpy as np
from walking import Walk, known_walk

from afo_sim.gait import GaitCycle
from afo_sim.gait_lab import WalkingFrame
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.stated import Stated
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints

MOVED = "moved 10 mm forward and 10 mm up"
WAYS = {
    "hip": ("Harrington 2007 from the pelvis' markers", 0.020, "a scaled model, or a static trial"),
    "knee": ("midpoint of R.Knee.Lat and R.Knee.Med", 0.010, ""),
    "ankle": ("R.Ankle.Lat", 0.008, "a marker on the inner malleolus", None, MOVED),
    "heel": ("R.Heel", None, ""),
    "toe": ("R.Toe", None, ""),
}


def stand_in(*, duration: float = 4.0, side: str = "right", **changes: Any) -> Any:
    """An `Imported` of a walk of `duration` [s]; `changes` replace its fields."""
    walk = known_walk()
    stride = walk.cycle.stride_time
    other = "left" if side == "right" else "right"
    walks = {side: walk, other: Walk(walk.cycle, walk.start + 0.5 * stride, walk.way + 0.55)}
    frame = WalkingFrame(
        forward=np.array([0.0, 0.0, -1.0]),
        up=np.array([0.0, 1.0, 0.0]),
        belt_speed=0.0,
        notices=(
            note(
                "direction",
                "walks along {forward}, up {up}, {subject} at {speed:.2f} m/s",
                subject="overground",
                forward="-z",
                up="y",
                speed=0.98,
            ),
        ),
    )
    time = np.arange(0.0, duration, 0.01)
    random = np.random.default_rng(5)
    legs, grounds, strides, cycles = {}, {}, [], []
    for name, leg in walks.items():
        legs[name] = _points(name, leg, time, 0.1 if name == "right" else -0.1)
        grounds[name] = _ground(name, leg, walks, duration)
        for number in range(int((duration - leg.start) / stride)):
            start = leg.heel_strike(number)
            strides.append(
                SimpleNamespace(
                    side=name,
                    start=start,
                    end=start + stride,
                    time=stride,
                    toe_off=start + 0.63 * stride,
                    start_by="force",
                    end_by="force",
                    loaded=number < 2,
                    closed=None,
                )
            )
            cycles.append(_cycle(walk.cycle, random, name, loaded=number < 2))
    own = [cycle for cycle in cycles if cycle.side == side]
    fields = ("shank_angle", "knee_angle", "ankle_angle", "grf_x", "grf_z", "ankle_moment")
    band = {name: np.nanstd([getattr(c, name) for c in own], axis=0) for name in fields}
    given = {
        "cycle": dataclasses.replace(own[0], side=side),
        "chosen": (0,),
        "strides": tuple(strides),
        "cycles": tuple(cycles),
        "band": band if len(own) > 1 else None,
        "legs": legs,
        "motions": {},
        "grounds": grounds,
        "frame": frame,
        "checks": (),
        "mass": SimpleNamespace(mass=67.2, how="given", estimated=66.5, remarks=(), warnings=()),
        "zero": np.radians(-4.2),
        "reference": walk.cycle.ankle_moment * 0.98,
        "trial": _trial(),
        "remarks": (),
        "warnings": (),
    }
    found = SimpleNamespace(**(given | changes))
    found.number = lambda index: sum(
        stride.side == found.strides[index].side for stride in found.strides[: index + 1]
    )
    return found


def _trial() -> SimpleNamespace:
    """The files, and two plates whose corners are known."""
    plates = []
    for number, x in enumerate((0.35, 0.9), start=1):
        right = 0.1 if number == 1 else -0.1
        corners = [[right + a, 0.0, -x - b] for a, b in ((-0.2, -0.3), (0.2, -0.3), (0.2, 0.3), (-0.2, 0.3))]
        plates.append(SimpleNamespace(name=str(number), corners=np.array(corners)))
    files = (pathlib.Path("walk.trc"), pathlib.Path("walk_grf.mot"))
    markers = SimpleNamespace(file=files[0])
    none = dict.fromkeys(("angles", "bodies", "moments", "standing"))
    return SimpleNamespace(files=files, plates=tuple(plates), markers=markers, stated=Stated(), **none)


def _points(name: str, walk: Walk, time: np.ndarray, right: float) -> LegPoints:
    plane = walk.points(time)
    space = {r: np.column_stack([np.full(len(time), right), p[:, 1], -p[:, 0]]) for r, p in plane.items()}
    points = {role: LegPoint(space[role], *way) for role, way in WAYS.items()}
    middle = space["pelvis"] * [0.0, 1.0, 1.0]
    return LegPoints(name, time, points, pelvis=middle, outline={"heel": -0.06, "toe": 0.19})


def _ground(name: str, walk: Walk, walks: dict[str, Walk], duration: float) -> GroundForce:
    time = np.arange(0.0, duration, 0.001)
    forward, upward, place = walk.force(time)
    plates = {str(k): (time, leg.force(time)[1]) for k, leg in enumerate(walks.values(), start=1)}
    on = upward > 20.0
    edges = np.flatnonzero(np.diff(np.r_[False, on, False].astype(int)))
    number = str(1 + list(walks).index(name))
    contacts = tuple(
        PlateContact(number, time[first], time[stop - 1], begins=bool(first > 0), ends=bool(stop < len(time)))
        for first, stop in zip(edges[::2], edges[1::2], strict=True)
    )
    return GroundForce(time, forward, upward, place * upward, contacts, plates)


def _cycle(cycle: GaitCycle, random: np.random.Generator, side: str, *, loaded: bool) -> GaitCycle:
    """The walk's stride, a little different each time."""
    wave = np.sin(2.0 * np.pi * (cycle.phase + random.uniform()))
    changed = {n: getattr(cycle, n) + 0.03 * random.normal() * wave for n in ("shank_angle", "ankle_angle")}
    changed["knee_angle"] = cycle.knee_angle + 0.05 * random.normal() * wave
    for name in ("grf_x", "grf_z", "cop_x", "ankle_moment"):
        scale = 1.0 + 0.04 * random.normal() if loaded else np.nan
        changed[name] = getattr(cycle, name) * scale
    return dataclasses.replace(cycle, side=side, **changed)
