"""The files of one walking trial, recognised by their columns."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass

from afo_sim.common.errors import InputError
from afo_sim.gait.readers.axes import Axes, find_axes
from afo_sim.gait.readers.choices import Choices
from afo_sim.gait.readers.leg_motion import ANGLES, LegMotion, from_joint_angles, from_markers
from afo_sim.gait.readers.markers import Markers
from afo_sim.gait.readers.opensim_table import OpenSimTable, read_opensim_table
from afo_sim.gait.readers.plates import Plate, plates_of

SUFFIXES = ".mot, .sto, .trc, .c3d"


@dataclass(frozen=True, eq=False)
class WalkingTrial:
    """Tables in the files of one walking trial."""

    files: tuple[pathlib.Path, ...]
    plates: tuple[Plate, ...]
    markers: Markers | None = None
    angles: OpenSimTable | None = None  # inverse kinematics
    bodies: OpenSimTable | None = None  # positions of bodies
    moments: OpenSimTable | None = None  # inverse dynamics

    def motion(self, choices: Choices) -> tuple[LegMotion, Axes]:
        """The leg's motion, and the axes that plates and markers are in.

        Angles come from inverse kinematics if there is any, else from markers.
        """
        if self.angles is not None:
            axes = Axes(choices.forward or "x", choices.up or "y")
            return from_joint_angles(self.angles, choices, self.markers, self.bodies, axes), axes
        if self.markers is None:
            raise InputError(
                "no file holds the leg's motion",
                file=_names(self.files),
                allowed=f"joint angles ({', '.join(ANGLES)}) in a .mot or .sto, or markers in a .trc or .c3d",
            )
        axes = find_axes(self.markers, choices)
        return from_markers(self.markers, axes, choices), axes


def read_trial(files: Sequence[pathlib.Path]) -> WalkingTrial:
    """Read the files of one trial, in any order.

    Parameters
    ----------
    files : .mot and .sto (joint angles, ground reaction, joint moments, body positions), .trc, .c3d

    Raises
    ------
    InputError
        A file of another kind, two of the same kind, or no ground force.
    """
    found: dict[str, Markers | OpenSimTable] = {}
    plates: list[Plate] = []
    for file in files:
        kind: str = ""
        content: Markers | OpenSimTable
        suffix = file.suffix.lower()
        if suffix in (".mot", ".sto"):
            content = read_opensim_table(file)
            kind = _kind(content)
            more = plates_of(content) if kind == "plates" else []
        elif suffix == ".trc":
            from afo_sim.gait.readers.trc import read_trc

            kind, content, more = "markers", read_trc(file), []
        elif suffix == ".c3d":
            from afo_sim.gait.readers.c3d import read_c3d

            content, more = read_c3d(file)
            kind = "markers"
        else:
            raise InputError("is not a kind of file that can be imported", file=file, allowed=SUFFIXES)
        if more and plates:
            raise InputError(
                "is a second file with force plates", file=file, allowed="the files of one trial"
            )
        plates += more
        if kind != "plates":
            if kind in found:
                raise InputError(f"is a second file with {kind}", file=file, allowed="the files of one trial")
            found[kind] = content
    if not plates:
        raise InputError(
            "no file holds ground forces",
            file=_names(files),
            allowed="columns such as ground_force_vx, _vy, _px in a .mot, or a C3D with force plates",
        )
    return WalkingTrial(files=tuple(files), plates=tuple(plates), **found)  # type: ignore[arg-type]


def _kind(table: OpenSimTable) -> str:
    """Name of a trial's table, by its columns."""
    names = list(table.columns)
    if plates_of(table):
        return "plates"
    if any(name.startswith(("ankle_angle_", "knee_angle_")) and name.endswith("_moment") for name in names):
        return "moments"
    if any(name.startswith("talus_") for name in names):
        return "bodies"
    if any(name.startswith(("ankle_angle_", "knee_angle_")) for name in names):
        return "angles"
    raise InputError(
        "holds neither joint angles, joint moments, body positions nor ground forces",
        file=table.file,
        allowed="columns such as ankle_angle_r, ankle_angle_r_moment, talus_r_X, ground_force_vx; "
        f"it has {', '.join(names[:8])}",
    )


def _names(files: Sequence[pathlib.Path]) -> str:
    return ", ".join(str(file) for file in files)
