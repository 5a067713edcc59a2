"""The model of a response, which runs leave beside its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nanorom.errors import FileError
from nanorom.results.response import Response
from nanorom.rom.model import ReducedModel

MODEL = "rom.h5"
SAME = 1e-9  # relative difference of natural frequencies of one model


def model_beside(response: Response, path: Path) -> ReducedModel:
    """The model beside the file of a response at a path; raises FileError if it is another."""
    beside = path.with_name(MODEL)
    model = ReducedModel.load(beside)
    same = model.label == response.label
    if not same or not np.allclose(model.frequency, response.frequency, SAME, 0):
        raise FileError(f"{beside}: is of other modes than {path.name}")
    return model
