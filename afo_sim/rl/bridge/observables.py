"""What an orthosis lets an agent observe, each with dm_control's delay, corruptor, buffer and aggregator."""

from dm_control.composer.define import observable as named

from afo_sim.rl.bridge.dm import composer, observable


class OrthosisObservables(composer.Observables):
    """Sensors of an orthosis; `enable_all()`, or `set_options({"pressure": {"delay": 3, "enabled": True}})`.

    An ideal sensor reads the present state. Delays and update intervals count physics steps.
    """

    @named
    def pressure(self) -> observable.Generic:
        """Gauge pressure of each chamber [Pa] (n_chamber,), in the order of `entity.chambers`."""
        return observable.Generic(lambda physics: self._entity.pressure(physics))

    @named
    def air_mass(self) -> observable.Generic:
        """Mass of the air in each chamber [kg] (n_chamber,)."""
        return observable.Generic(lambda physics: self._entity.air_mass(physics))

    @named
    def force(self) -> observable.Generic:
        """Tension of each muscle [N] (n_muscle,), in the order of `entity.muscles`."""
        return observable.Generic(lambda physics: self._entity.force(physics))

    @named
    def contraction(self) -> observable.Generic:
        """Contraction ratio of each muscle's own length, shorter positive [-] (n_muscle,)."""
        return observable.Generic(lambda physics: self._entity.contraction(physics))

    @named
    def cuff_force(self) -> observable.Generic:
        """Pull of all muscles on each anchor that gives [N] (n_anchor,), in the order of `entity.anchors`."""
        return observable.Generic(lambda physics: self._entity.cuff_force(physics))

    @named
    def ankle_angle(self) -> observable.Generic:
        """Angle of the ankle, dorsiflexion positive [rad] (1,)."""
        return observable.Generic(lambda physics: self._entity.ankle_angle(physics))
