"""The callbacks, compiled or as plain Python: installed while anybody holds them, and shown to act."""

import ctypes
import functools
import threading
import weakref
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import SimpleNamespace, TracebackType
from typing import Any, Literal, Self

import mujoco
import numpy as np

from afo_sim.common import CallbackError, InputError
from afo_sim.native import slots
from afo_sim.native.callbacks import define
from afo_sim.native.compiled import callbacks, mujoco_library, settle_plugin
from afo_sim.native.error_codes import COMPLAINTS, FINE
from afo_sim.native.guides import behind_guides
from afo_sim.native.network import network_dyn
from afo_sim.native.refuse import marked_only
from afo_sim.native.rows import of_kind
from afo_sim.native.struct_layout import verify

Mode = Literal["native", "python"]


@functools.cache
def _native_callbacks() -> tuple[Any, Any]:
    verify()
    return callbacks()


class KernelFailure(Exception):
    """A complaint that ends a simulation, as of a kernel in Python mode; compiled ones call `mju_error`."""


@functools.cache
def _python_callbacks() -> tuple[Any, Any]:
    def fail(complaint: int, actuator: int) -> None:
        raise KernelFailure(f"{COMPLAINTS[complaint]} {actuator}")

    bias, dyn = (marked_only(kernel, fail) for kernel in define(fail))

    def total(kernel: Any) -> Any:
        def callback(m: Any, d: Any, i: int) -> float:
            try:
                return float(kernel(_flat(m), _FlatData(d), i))
            except (ArithmeticError, ValueError) as error:  # compiled code gives inf or NaN instead
                raise KernelFailure(f"{error} in actuator {i}") from None

        return callback

    return total(bias), total(dyn)


def _flat(m: Any) -> Any:
    """The fields of a model that the kernels read, with the rows end to end as compiled code sees them."""
    return SimpleNamespace(
        nuser_actuator=m.nuser_actuator, actuator_user=m.actuator_user.reshape(-1),
        actuator_actadr=m.actuator_actadr, actuator_trnid=m.actuator_trnid.reshape(-1),
        tendon_adr=m.tendon_adr, wrap_type=m.wrap_type, wrap_objid=m.wrap_objid, site_bodyid=m.site_bodyid,
        geom_bodyid=m.geom_bodyid, opt=m.opt, signature=m.signature, nv=m.nv,
        body_subtreemass=m.body_subtreemass, dof_bodyid=m.dof_bodyid, dof_damping=m.dof_damping,
        dof_parentid=m.dof_parentid,
    )  # fmt: skip


class _FlatData:
    """An MjData whose rows stand end to end, as compiled code sees them; all else is its own."""

    def __init__(self, d: Any):
        self._data = d

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._data, name)
        return found.reshape(-1) if np.ndim(found) == 2 else found


NAMES = ("mjcb_act_bias", "mjcb_act_dyn")


@functools.cache
def _pointers() -> list[ctypes.c_void_p]:
    """MuJoCo's own two, which code in C sets without the bindings."""
    library = ctypes.CDLL(str(mujoco_library()))
    return [ctypes.c_void_p.in_dll(library, name) for name in NAMES]


def _current() -> tuple[Any, Any]:
    return mujoco.get_mjcb_act_bias(), mujoco.get_mjcb_act_dyn()


def _put(callbacks: tuple[Any, ...], addresses: tuple[int | None, ...] = (None, None)) -> None:
    setters = mujoco.set_mjcb_act_bias, mujoco.set_mjcb_act_dyn
    for put, pointer, callback, address in zip(setters, _pointers(), callbacks, addresses, strict=True):
        put(callback)
        pointer.value = address or pointer.value


def _silent(text: str) -> None:
    """A handler that drops warnings: the counters say the same; MuJoCo would also write a log file."""


# numbers, since NumPy compares MuJoCo's enumerations one by one
DYN_USER, GAIN_USER = int(mujoco.mjtDyn.mjDYN_USER), int(mujoco.mjtGain.mjGAIN_USER)
BIAS_USER = int(mujoco.mjtBias.mjBIAS_USER)
_Outer = tuple[tuple[Any, Any], Mode]  # callbacks of a block around another, and their mode


@dataclass
class _Callbacks:
    """The two pointers, of which a process has one each, and who wants them to be ours."""

    lock: threading.RLock = field(default_factory=threading.RLock)
    holders: dict[object, int] = field(default_factory=dict)
    ours: tuple[Any, Any] | None = None
    before: tuple[Any, Any] = (None, None)
    addresses: tuple[int | None, ...] = (None, None)  # before, too
    mode: Mode = "native"

    def take(self, holder: object, mode: Mode, *, block: bool = False) -> _Outer | None:
        """Count a holder; the first one installs."""
        wanted = _native_callbacks() if mode == "native" else _python_callbacks()
        with self.lock:
            self.holders[holder] = threading.get_ident()
            try:
                if self.ours is None:
                    self._install(mode, wanted)
                    return None
                self.check()
                if mode == self.mode:
                    return None
                if not block or len(set(self.holders.values())) > 1:
                    raise CallbackError(
                        f"the muscle callbacks are held in the mode {self.mode!r}; MuJoCo has room for one "
                        f"pair, and {mode!r} would change the simulations that hold them. Close those first."
                    )
                outer = self.ours, self.mode
                self.ours, self.mode = wanted, mode
                _put(wanted)
                return outer
            except BaseException:  # whatever it is, its caller holds nothing
                self.give(holder)
                raise

    def give(self, holder: object, outer: _Outer | None = None) -> None:
        """Count a holder off; the last one restores what was there before the first."""
        with self.lock:
            self.holders.pop(holder, None)
            if outer is not None and self.holders and _current() == self.ours:
                self.ours, self.mode = outer
                _put(outer[0])
            if self.holders or self.ours is None:
                return
            ours, self.ours = self.ours, None
            there = zip(_current(), ours, self.before, self.addresses, strict=True)
            # what somebody else has put there meanwhile is not ours to take away
            kept = [(before, at) if now is mine else (now, None) for now, mine, before, at in there]
            _put(*zip(*kept, strict=True))
            settle_plugin()  # whose data may have come or gone meanwhile
            if mujoco.get_mju_user_warning() is _silent:
                mujoco.set_mju_user_warning(None)

    def check(self) -> None:
        """Raise CallbackError where the pointers are no longer ours."""
        if self.ours is None or _current() != self.ours:
            raise CallbackError(
                "the muscle callbacks were replaced while they were held: the muscles would be limp. Close "
                "the simulations that hold them, take the other program's callback away, and begin again."
            )

    def _install(self, mode: Mode, wanted: tuple[Any, Any]) -> None:
        before, addresses = _current(), tuple(pointer.value for pointer in _pointers())
        known = [c for f in (_native_callbacks, _python_callbacks) if f.cache_info().currsize for c in f()]
        for name, callback, address in zip(NAMES, before, addresses, strict=True):
            natively = callback is None and address is not None
            if not (settle_plugin() if natively else any(callback is mine for mine in (None, *known))):
                raise CallbackError(
                    f"another {name} is installed in this process; MuJoCo has room for one, and "
                    "replacing it would change that program's simulation. Remove it "
                    f"(mujoco.set_{name}(None)) and try again; if it is an exported model's plugin, free its "
                    "data, or call afo_sim.install() before it is loaded."
                )
        self.before, self.addresses, self.ours, self.mode = before, addresses, wanted, mode
        _put(wanted)
        if mujoco.get_mju_user_warning() is None:
            mujoco.set_mju_user_warning(_silent)


CALLBACKS = _Callbacks()


@contextmanager
def installed(mode: Mode = "native") -> Iterator[None]:
    """Install the callbacks for the duration of a block, and restore what was there."""
    holder = object()
    outer = CALLBACKS.take(holder, mode, block=True)
    try:
        yield
        CALLBACKS.check()
    finally:
        CALLBACKS.give(holder, outer)


def asks_for_callback(model: mujoco.MjModel) -> np.ndarray:
    """Whether MuJoCo calls a callback for each actuator (nu,)."""
    dyn, gain, bias = model.actuator_dyntype, model.actuator_gaintype, model.actuator_biastype
    return np.asarray((dyn == DYN_USER) | (gain == GAIN_USER) | (bias == BIAS_USER))


# Places of a row that name other actuators: of what kind, and whether −1, none, will do.
REFERENCES: dict[slots.Kind, dict[int, tuple[slots.Kind, bool]]] = {kind: {} for kind in slots.ROWS} | {
    slots.Kind.MUSCLE: {
        slots.MUSCLE_ROW.leader: (slots.Kind.MUSCLE, False),
        slots.MUSCLE_ROW.chamber: (slots.Kind.CHAMBER, False),
        slots.MUSCLE_ROW.next: (slots.Kind.MUSCLE, True),
        slots.MUSCLE_ROW.friction_states: (slots.Kind.FRICTION, True),
    },
    slots.Kind.CHAMBER: {
        slots.CHAMBER_ROW.first_muscle: (slots.Kind.MUSCLE, True),
        slots.CHAMBER_ROW.next: (slots.Kind.CHAMBER, True),
        slots.CHAMBER_ROW.inlet: (slots.Kind.VALVE, False),
        slots.CHAMBER_ROW.outlet: (slots.Kind.VALVE, False),
    },
    slots.Kind.DRIVE: {slots.DRIVE_ROW.chamber: (slots.Kind.CHAMBER, False)},
    slots.Kind.FRICTION: {slots.FRICTION_ROW.muscle: (slots.Kind.MUSCLE, False)},
    slots.Kind.GRIP: {slots.GRIP_ROW.pad: (slots.Kind.PAD, False)},
    slots.Kind.REFLEX: {
        slots.REFLEX_ROW.other: (slots.Kind.REFLEX, False),
        slots.REFLEX_ROW.muscle: (slots.Kind.LEG_MUSCLE, False),
        slots.REFLEX_ROW.pad: (slots.Kind.PAD, False),
        slots.REFLEX_ROW.tissue: (slots.Kind.PASSIVE, False),
    },
    slots.Kind.NETWORK: {slots.NETWORK_ROW.first_chamber: (slots.Kind.CHAMBER, False)},
}


def assert_rows(model: mujoco.MjModel) -> None:
    """Check that this project's actuators, and all that ask for a callback, name actuators that exist."""
    rows, nu, asks = model.actuator_user, model.nu, asks_for_callback(model).tobytes()
    lost, (i, slot, kind, optional) = _references(rows[:, : slots.FIRST].tobytes(), asks)
    if lost is not None:
        raise CallbackError(f"actuator {model.actuator(lost).name!r} has lost its parameters")
    other = rows[i, slot]
    there = (other >= 0.0) & (other < nu) & (other == np.floor(other))
    there &= rows[np.where(there, other, 0.0).astype(int), slots.KIND] == kind
    wrong = np.flatnonzero(~(there | (optional & (other == -1.0))))
    if len(wrong):
        name = model.actuator(int(i[wrong[0]])).name
        raise CallbackError(f"actuator {name!r} refers to actuator {other[wrong[0]]:g}")


@functools.lru_cache(maxsize=16)  # models of one layout have the same
def _references(heads: bytes, asks: bytes) -> tuple[int | None, tuple[np.ndarray, ...]]:
    """First actuator without parameters; row, place, wanted kind of each reference, whether none will do."""
    found: list[tuple[int, int, float, bool]] = []
    pairs = np.frombuffer(heads).reshape(-1, slots.FIRST).tolist()
    for i, (head, asked) in enumerate(zip(pairs, np.frombuffer(asks, bool), strict=True)):
        if kind := slots.kind_of(head, 0):
            found += [(i, slot, *wanted) for slot, wanted in REFERENCES[slots.Kind(kind)].items()]
        elif asked or head[slots.LAYOUT] == slots.THIS_LAYOUT:
            return i, (np.empty(0, int),) * 4
    rows, places, kinds, optional = np.array(found, float).reshape(-1, 4).T
    return None, (rows.astype(int), places.astype(int), kinds, optional > 0.0)


def assert_live(model: mujoco.MjModel, data: mujoco.MjData, muscles: Sequence[int]) -> None:
    """Check, against the kernels run as plain Python, that every muscle really pulls."""
    plain, flat, found = _flat(model), _FlatData(data), data.userdata.copy()
    data.userdata[:] = 0.0
    for network in of_kind(model, slots.Kind.NETWORK):
        complaint, actuator = network_dyn(plain, flat, network, model.nuser_actuator * network)
        if complaint != FINE:
            raise CallbackError(f"{COMPLAINTS[complaint]} {actuator}")
    expected = data.userdata.copy()
    data.userdata[:] = found
    for i in muscles:
        leader = int(model.actuator_user[i, slots.MUSCLE_ROW.leader])
        at = int(model.actuator_user[leader, slots.MUSCLE_ROW.userdata])
        pulls = expected[at + slots.LEADER_DATA.tension]
        if model.actuator_user[i, slots.MUSCLE_ROW.wrap_friction] > 0.0:
            pulls, _ = behind_guides(plain, flat, i, model.nuser_actuator * i, pulls)
        carries = -data.actuator_force[i]
        if not abs(carries - pulls) <= 1e-9 * max(1.0, abs(pulls)):
            raise CallbackError(
                f"muscle actuator {i} carries {carries:.6g} N where its law gives {pulls:.6g} N: "
                "the muscle callbacks are not the ones in force"
            )


class Closing:
    """What is closed at the end of a `with` block."""

    def close(self) -> None:
        """Give back what is held; a second call does nothing."""
        raise NotImplementedError

    def __reduce__(self) -> Any:
        name = type(self).__name__
        raise TypeError(f"a {name} is neither copied nor pickled: whoever needs the callbacks opens another")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Hold(Closing):
    """A holder of the callbacks; `close`, garbage collection or the end of Python gives them back."""

    def __init__(self, mode: Mode = "native"):
        holder = object()
        CALLBACKS.take(holder, mode)
        self._end = weakref.finalize(self, CALLBACKS.give, holder)
        self._caller = ""

    def close(self) -> None:
        """Give the callbacks back; a second call does nothing."""
        self.still()
        self._end()

    @property
    def closed(self) -> bool:
        """Whether they have been given back."""
        return not self._end.alive

    @contextmanager
    def calling(self, caller: str) -> Iterator[None]:
        """A block that calls others' code, which may ask for what `still` refuses."""
        self._caller = caller
        try:
            yield
        finally:
            self._caller = ""

    def still(self, unless: str = "") -> None:
        """Refuse what is asked by code that a step calls, `unless` it is called so."""
        if self._caller not in ("", unless):
            allowed = "a change between steps; in a controller copy(), for a trial roll-out"
            raise InputError("calls this, which would mix two states", field=self._caller, allowed=allowed)

    def check(self) -> None:
        """Refuse to go on in the midst of a step, and where muscles would be limp; it takes 3 µs."""
        self.still()
        if not self._end.alive:
            raise CallbackError("is closed: the muscle callbacks were given back, and muscles would be limp")
        CALLBACKS.check()


_FOR_GOOD: list[Hold] = []


def install() -> None:
    """Put the muscles in force until Python ends: plain `mujoco.mj_step` steps every model that has them.

    Such are `model.xml` of a run, what `afo-sim attach` writes, and exports for MuJoCo, with or without their
    plugin. Raises CallbackError where another program's callbacks are installed.

    >>> install()
    >>> muscles = attach("adult_75kg", "s1").muscles
    """
    _FOR_GOOD[:] = [Hold()]
