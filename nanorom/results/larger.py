"""A response held against the larger model that came with its own: estimates of its points."""

from __future__ import annotations

import attrs
import numpy as np

from nanorom.continuation.larger.equations import LargerSystem
from nanorom.errors import ModelError
from nanorom.results.estimates import estimates_of
from nanorom.results.question import Question
from nanorom.results.response import Response
from nanorom.rom.larger import extended
from nanorom.rom.model import ReducedModel


def estimated(response: Response, model: ReducedModel, question: Question) -> Response:
    """A response with estimates of all its levels, as it is if the model has no larger one.

    Nor are there any if the larger model does not know the drive's aim.
    """
    if model.larger is None:
        return response
    places = model.larger.places(model)
    count = len(model.larger.label)
    outside = np.setdiff1d(np.arange(count), places)
    wide = ReducedModel(scene=model.scene, **model.larger.matched(model).arrays())
    damping = question.damping
    if damping is not None:
        question = attrs.evolve(question, damping=extended(damping, places, count))
    try:
        system, _, _ = question.of(wide)
    except ModelError:  # it does not know the drive's aim
        return response
    tables = [
        estimates_of(LargerSystem(system, places, d.direct, d.parametric), d)
        for d in response.diagrams
    ]
    names = tuple(model.larger.label[n] for n in outside)
    return attrs.evolve(response, outside_label=names, estimates=tuple(tables))
