"""A session's folder as OpenCap hands it out: the person's model, each trial's angles and markers."""

import pathlib
import re
from collections.abc import Sequence

from afo_sim.common import InputError, read_foreign
from afo_sim.gait_lab.readers.stated import LIKELY, Stated

_MOTIONS = ("MarkerData/*.trc", "Kinematics/*.mot")  # of a trial by its name; angles count before markers


def of_session(files: Sequence[pathlib.Path]) -> tuple[list[pathlib.Path], Stated]:
    """The files of one trial of a session's folder, and its facts on the person; else the given files."""
    folder = next((file for file in files if file.is_dir()), None)
    motions = {} if folder is None else {file.stem: file for kind in _MOTIONS for file in folder.rglob(kind)}
    motions.pop("neutral", None)  # the standing trial by which the model is scaled
    if folder is None or not motions:
        return list(files), Stated()
    given = [file for file in files if file != folder]
    named = [file.stem for file in given if file.stem in motions] or sorted(motions)
    if len(set(named)) > 1:
        problem = f"holds {len(named)} trials: {', '.join(named)}"
        allowed = f"the folder and a file of one of them, such as {motions[named[0]]}"
        raise InputError(problem, file=folder, allowed=allowed)
    forces = re.compile(rf"{re.escape(named[0])}(_\w+)?_(forces|grf)")
    plates = [file for file in sorted(folder.rglob("*.mot")) if forces.fullmatch(file.stem)]
    plates += [file for file in given if file.stem not in motions]
    if not plates:
        problem = f"has no ground forces of {named[0]}: OpenCap's cameras measure none"
        allowed = "the folder and a .mot of force plates, by the trial's clock and in its axes"
        raise InputError(problem, file=folder, allowed=allowed)
    models = sorted(folder.rglob("*.osim"), key=lambda file: len(file.name))[:1]  # before those made of it
    said = "".join(read_foreign(file) for file in folder.rglob("sessionMetadata.yaml"))
    typed = {key: float(text) for key, text in re.findall(r"^(mass|height)_\w+: *(\d+\.?\d*)$", said, re.M)}
    person = {key: value for key, value in typed.items() if LIKELY[key][0] <= value <= LIKELY[key][1]}
    return [motions[named[0]], *models, *plates], Stated(mass=person.get("mass"), height=person.get("height"))
