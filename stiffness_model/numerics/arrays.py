"""The type of all numbers in arrays: double precision."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
