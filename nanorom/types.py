"""Types that every room shares."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]  # stage, done, of how many
Numbers = NDArray[Any]  # whole or complex numbers
