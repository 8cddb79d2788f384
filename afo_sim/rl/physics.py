"""A compiled scenario as a dm_control Physics: same model, same start, same bits as a run."""

import copy
import os
from collections.abc import Mapping
from typing import NoReturn, Self

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import Foreign, Function, InputError, JsonMapping
from afo_sim.control import Command, checked_pressure
from afo_sim.description import Scenario
from afo_sim.model import Built, equilibrium, walking_start
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.rl.dm import PhysicsError, Present, dm
from afo_sim.simulation import FAILURES, FIELDS, STATE, Commander, Forkable, column_at, failed

FULL = mujoco.mjtState.mjSTATE_INTEGRATION


class ScenarioPhysics(Forkable, native.Closing, dm.Physics):
    """A scenario as dm_control's Physics, with its muscles' callbacks held until `close`.

    Each step takes its inputs from the scenario (its valve timing, in walking the recorded walking), unless
    `set_valves`, `supply_pressure` or `set_control` command otherwise; `reset` goes back to its start and its
    timing. A described controller does not act: whoever steps is the controller, and without timing valves
    are shut until they are commanded. Readers report the present state, in a run's units and signs.
    """

    _memory: tuple[str, ...] = ("_commander.commands", "_supply", "_control", "_whole")

    def __init__(self, built: Built, timed: bool = True):
        if built.scenario.callback != "native":
            problem = "is for reading kernels; dm_control steps compiled ones"
            raise InputError(problem, field="callback", value=built.scenario.callback, allowed="native")
        self.built, self.timed, self._of = built, timed, (built.scenario,)
        self._hold = native.Hold()
        try:
            # of its own, whose numbers may be changed; with the shapes that are drawn it moves alike
            self._model = copy.copy(built.full_model)
            self._schedule = schedule.controls(built)
            first = self._schedule[0]
            native.assert_rows(built.model)
            self._start = equilibrium(built, first) if built.walk is None else walking_start(built, first)
            native.assert_muscles_pull(self._model, self._start)
            self._present = Present(self._model)
            self._forget()
            super().__init__(dm.wrapper.MjData(dm.wrapper.MjModel(self._model)))
            self.reset()
        except FAILURES as error:
            self._hold.close()
            raise failed(built.model, str(error), 0) from None
        except BaseException:  # whatever ends it, the callbacks are given back
            self._hold.close()
            raise

    # inputs

    def _forget(self) -> None:
        self._commander = Commander(self.built, timed=self.timed)
        self._supply: float | None = None
        self._control: np.ndarray | None = None
        self._written: np.ndarray | None = None

    def set_valves(self, **commands: Command) -> None:
        """Command the valves of chambers from the next step on, by the chamber's name [-]."""
        self._hold.check()
        self._commander.take(commands)

    @property
    def supply_pressure(self) -> float:
        """Gauge pressure of the supply [Pa], 0 to 2e6; assign it to change it from the next step on."""
        return self.built.scenario.supply.pressure if self._supply is None else self._supply

    @supply_pressure.setter
    def supply_pressure(self, pressure: float) -> None:
        self._supply = checked_pressure(pressure)

    def set_control(self, control: np.ndarray) -> None:
        """Give all inputs (nu,) of the following steps, instead of the scenario's and of all commands."""
        self._hold.check()
        given = np.array(control, dtype=float)
        if given.shape != (self.model.nu,):
            allowed = f"({self.model.nu},)"
            raise InputError("has another shape", field="control", value=given.shape, allowed=allowed)
        self._control = given
        self._write(given)

    def _inputs(self, step: int, count: int = 1) -> np.ndarray:
        """Inputs of the steps from one on (n, nu), count of them or as many as the recorded walking has."""
        if self._control is not None:
            return np.broadcast_to(self._control, (count, len(self._control)))
        if step + count > len(self._schedule) and self.built.walk is None:
            self._schedule = schedule.controls(self.built, 2 * (step + count))
        rows, index = self._schedule[step : step + count].copy(), self.built.index
        if not len(rows):
            end = len(self._schedule) * self.built.scenario.timestep
            problem = f"the recorded walking ends at t = {end:.6g} s: reset(), or build a longer scenario"
            raise InputError(problem, field="duration")
        self._commander.apply(rows)
        if self._supply is not None:
            rows[:, list(index.chambers.values())] = self._supply
        return rows

    def _write(self, row: np.ndarray) -> None:
        self.data.ptr.ctrl[:] = row
        self._written = row

    def _refuse_ctrl(self) -> None:
        """Refuse inputs that were written where the next step would overwrite them."""
        if self._written is None:
            return
        mine = self.data.ptr.ctrl != self._written
        if not mine.any():
            return
        mine[list(self.built.index.muscles.values())] = False  # the callbacks' own
        if mine.any():
            name = self.model.id2name(int(np.flatnonzero(mine)[0]), "actuator")
            problem = f"data.ctrl of {name!r} was written directly, and each step takes its inputs elsewhere"
            allowed = "set_valves, supply_pressure, or set_control for all inputs"
            raise InputError(problem, field="data.ctrl", allowed=allowed)

    # steps

    def step(self, nstep: int = 1) -> None:
        """Step, with the inputs of each step's own time."""
        self._hold.check()
        self._refuse_ctrl()
        left = nstep
        while left > 0:
            inputs = self._inputs(self._step_number(), left)
            try:
                with self._hold.calling("step"):
                    self._advance(inputs)
            except FAILURES as error:
                raise PhysicsError(str(failed(self.built.model, str(error), self._step_number()))) from None
            left -= len(inputs)

    def _advance(self, inputs: np.ndarray) -> None:
        """Step through inputs (n, nu), as dm_control does: positions in `data` are the present state's."""
        model, data, last = self.model.ptr, self.data.ptr, len(inputs) - 1
        ctrl, mj_step = data.ctrl, mujoco.mj_step
        with self.check_invalid_state():
            for k, row in enumerate(inputs):
                ctrl[:] = row
                if k == last:
                    self._written = row
                    self._before_last()
                if k == 0 and self.legacy_step:
                    mujoco.mj_step2(model, data)  # mj_step1 came at the end of the call before
                else:
                    mj_step(model, data)
            if self.legacy_step:
                mujoco.mj_step1(model, data)

    def _before_last(self) -> None:
        """Look at the state before the last step; this one does not."""

    def _step_number(self) -> int:
        return round(self.data.time / self.built.scenario.timestep)

    def reset(self, keyframe_id: int | None = None) -> None:
        """Go back to the scenario's start and its own timing; `keyframe_id` is refused."""
        if keyframe_id is not None:
            raise InputError("there are no keyframes: reset() goes to the scenario's start", field="reset")
        self._hold.check()
        self._forget()
        mujoco.mj_resetData(self.model.ptr, self.data.ptr)
        mujoco.mj_setState(self.model.ptr, self.data.ptr, self._start, FULL)
        self.after_reset()

    def after_reset(self) -> None:
        """Make all fields of `data` those of the state, with the inputs of its time."""
        self._hold.check()
        if np.isfinite(self.data.time):
            self._write(self._inputs(self._step_number())[0])
        self.forward()

    def _reload_from_data(self, data: Foreign) -> None:
        # dm_control resets here, before there is air in the chambers
        mujoco.mj_setState(data.model.ptr, data.ptr, self._start, FULL)
        super()._reload_from_data(data)

    # life

    def close(self) -> None:
        """Free the simulation and give the muscle callbacks back; a second call does nothing."""
        self.free()

    def free(self) -> None:
        """As `close`; dm_control's name for it."""
        self._hold.close()
        super().free()

    def get_state(self, sig: int | None = None) -> np.ndarray:
        """MuJoCo's state, by default the whole of it with time and air; `state()` has the commands, too."""
        self._hold.check()
        return super().get_state(FULL if sig is None else sig)

    def set_state(self, physics_state: np.ndarray, sig: int | None = None) -> None:
        """Set what `get_state` gave, and all fields of `data` to those of this state."""
        self._hold.check()
        super().set_state(physics_state, FULL if sig is None else sig)
        self._written = None
        self.forward()

    _whole = property(lambda self: self.get_state(), lambda self, state: self.set_state(state))

    def _like(self) -> tuple[Function, tuple[object, ...]]:
        return type(self), (self.built, self.timed)

    def copy(self, share_model: bool = False) -> Self:
        """A Physics of its own in the same state and with the same commands; the model is never shared."""
        return super().copy()

    def _refuse_reload(self, *_: object, **__: object) -> NoReturn:
        raise InputError("a scenario's Physics keeps its model: build another", field="reload")

    reload_from_xml_string = reload_from_xml_path = _refuse_reload

    # readers

    def read(self, column: str) -> float:
        """A run's column of the present state and inputs; rates of a muscle are means of the step before."""
        self._hold.check()
        step = self._step_number()
        over = self.built.walk is not None and step >= len(self._schedule)
        inputs = np.array(self.data.ctrl) if over else self._inputs(step)[0]
        data = self._present.of(self.data.ptr, inputs)
        rows = {name: np.array(getattr(data, name), float).reshape(1, -1) for name in (*STATE, *FIELDS)}
        found = np.ravel(column_at(self.built, column, rows, inputs[None], step))
        if not found.size:
            raise InputError("the recorded walking is over, which this column follows", field=column)
        return float(found[0])

    def pressure(self, chamber: str) -> float:
        """Pressure in a chamber, gauge [Pa]."""
        return self.read(f"chamber/{chamber}/pressure")

    def air_mass(self, chamber: str) -> float:
        """Mass of the air in a chamber [kg]."""
        return self.read(f"chamber/{chamber}/mass")

    def force(self, muscle: str) -> float:
        """Tension of a muscle, such as "dorsiflexor_1" [N]."""
        return self.read(f"muscle/{muscle}/force")

    def contraction(self, muscle: str) -> float:
        """Contraction ratio (L0 − L)/L0 of a muscle's own length, shorter positive [-]."""
        return self.read(f"muscle/{muscle}/contraction")

    def ankle_angle(self) -> float:
        """Angle of the ankle, dorsiflexion positive [rad]."""
        return self.read("ankle/angle")

    def orthosis_moment(self) -> float:
        """Moment of all muscles of the orthosis about the ankle, dorsiflexion positive [N·m]."""
        return self.read("ankle/moment/orthosis")


def dm_control_physics(
    scenario: str | os.PathLike[str] | Scenario | JsonMapping,
    sets: Mapping[str, object] | None = None,
    *,
    timed: bool = True,
) -> ScenarioPhysics:
    """Compile a scenario and stand it at its start; without `timed` valves are shut until commanded."""
    return ScenarioPhysics(build(scenario, sets), timed=timed)
