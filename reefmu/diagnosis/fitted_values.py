"""Fitted parameters with their intervals: of named effects, those that stopped at a bound, and sizes by amplitude."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from stiffness_model.transmission_losses import PRESLIDING_ANGLE


@dataclass(frozen=True)
class Value:
    """One fitted parameter with its 95 % interval low ... high.

    warning: why it is uncertain, "" if it is not; bound: "low" or "high" if the fit stopped at that bound of its range.
    The interval is then one-sided: it ends at the bound, beyond which the record asks for a value.
    """

    value: float
    low: float
    high: float
    unit: str
    warning: str = ""
    bound: str = ""

    def to_dict(self) -> dict[str, Any]:
        """The value as diagnosis.json has it, without texts that are empty."""
        return {key: value for key, value in asdict(self).items() if key not in ("warning", "bound") or value}


@dataclass(frozen=True)
class ParameterAtBound:
    """A parameter of the base curve ("exponent") or of an effect ("hysteresis.presliding") that stopped at a bound.

    bound: "low" or "high"; low, high: of its one-sided 95 % interval, None on the side of the bound, and on both sides
    if the bound is that of an earlier fit; meaning: what it says of the record.
    """

    parameter: str
    bound: str
    value: float
    low: float | None
    high: float | None
    unit: str
    meaning: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect that is missing in the model; share: part of the systematic gap that it removes; probability: sum over
    the hypotheses that contain it, 0 where none were compared."""

    name: str
    parameters: dict[str, Value]
    share: float
    probability: float = 0.0


@dataclass(frozen=True)
class AmplitudeSize:
    """Size of an effect in the cycles of one amplitude, N.m: mean and 95 % interval over that number of cycles."""

    amplitude: float
    value: float
    low: float
    high: float
    cycles: int


@dataclass(frozen=True)
class AmplitudeTest:
    """Sizes of one parameter by amplitude, smallest first. p: that they are equal but for the scatter of cycles, times
    the number of parameters that are tested (Bonferroni); power, power_low, power_high: of the amplitude with which the
    size grows from the smallest to the largest, with its 95 % interval, None where a size is not positive; laws: those
    that would reconcile the sizes.
    """

    effect: str
    parameter: str
    unit: str
    sizes: tuple[AmplitudeSize, ...]
    p: float
    power: float | None
    power_low: float | None
    power_high: float | None
    laws: tuple[str, ...]


@dataclass(frozen=True)
class EfficiencyAtLoad:
    """Efficiency at a load at the output, N.m, and a speed of the crank, rad/s: with the crank driving, and with the
    output driving, where it is not positive if the drive locks itself."""

    load: float
    speed: float
    driving: Value
    driven_back: Value


@dataclass(frozen=True)
class CrankLosses:
    """Losses between crank and output, from the torques of both.

    parameters: of the effect `crank_friction`, by name; sensors: what is wrong with the torques, "offset", N.m at
    the crank, and "scale", that of the motor's torque over that of the torque at the output. efficiencies: at half and
    at full load. greatest: N.m at the crank, friction at full load. before, after: N.m at the crank, root mean square
    of what the motor's torque exceeds that of the output by, and of what the friction leaves of it. replicates, kind:
    number and name of what the intervals count, such as cycles. assumptions: of what the record does not separate.
    """

    parameters: dict[str, Value]
    sensors: dict[str, Value]
    efficiencies: tuple[EfficiencyAtLoad, ...]
    greatest: float
    before: float
    after: float
    replicates: int
    kind: str
    assumptions: tuple[str, ...] = ()

    def effect_values(self) -> dict[str, float]:
        """Values of the parameters of `crank_friction` for a model, with the stiffness that data of losses get."""
        values = {name: value.value for name, value in self.parameters.items()}
        return values | ({"stiffness": self.greatest / PRESLIDING_ANGLE} if self.greatest > 0 else {})

    def to_dict(self) -> dict[str, Any]:
        """The key "crank_friction" of diagnosis.json."""
        return {
            "parameters": {name: value.to_dict() for name, value in self.parameters.items()},
            "sensors": {name: value.to_dict() for name, value in self.sensors.items()},
            "efficiency": [
                {
                    "load [N.m]": at.load,
                    "crank_speed [rad/s]": at.speed,
                    "driving": at.driving.to_dict(),
                    "driven_back": at.driven_back.to_dict(),
                }
                for at in self.efficiencies
            ],
            "gap": {"unit": "N.m", "at": "crank", "before": self.before, "after": self.after},
            "replicates": self.replicates,
            "replicate": self.kind,
            "assumptions": list(self.assumptions),
        }
