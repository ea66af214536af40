"""An individual drive as it turns: torque over twist and output angle, transmission error, order spectra.

* `individual_drive`: one drive with its own parts; `element_positions`: where its elements stand at an output angle.
* `individual_contacts`: their contacts; `maps`: torque over twist and angle.
* `element_torques`: torque of every element along a path of twists and output angles, and its derivatives.
* `loaded`: twist under a constant torque and without load; `orders`: order spectra.
* `twist_scatter`: several individuals; `ripple_plots`: pictures.

>>> import numpy as np
>>> from stiffness_model import load_drive
>>> drive = load_drive("drive_1")
>>> one = draw_individual(drive, seed=7)
>>> torque = turning_map(one, [drive.max_twist], angles_over_turn(drive, per_pass=2)).torque[:, 0]
>>> [round(float(order), 2) for order in spectrum(drive, torque).crank_order[[29, 30, 2610]]]
[1.0, 1.03, 90.0]
"""

from .element_positions import elements_at
from .element_torques import ElementPath, Places, Steps, element_path
from .individual_drive import Individual, angles_over_turn, draw_individual, mean_individual
from .loaded import LoadedTurn, NoLoad, loaded_turn, no_load
from .maps import TurningMap, turning_map
from .orders import Spectrum, spectrum

__all__ = [
    "ElementPath",
    "Individual",
    "LoadedTurn",
    "NoLoad",
    "Places",
    "Spectrum",
    "Steps",
    "TurningMap",
    "draw_individual",
    "element_path",
    "loaded_turn",
    "mean_individual",
    "no_load",
    "spectrum",
    "elements_at",
    "angles_over_turn",
    "turning_map",
]
