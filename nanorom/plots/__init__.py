"""Pictures of modes and responses, made for a column of a paper and a slide alike."""

from nanorom.plots.basins import basins_figure
from nanorom.plots.comb import comb_figure
from nanorom.plots.design import design_figure
from nanorom.plots.device import device_figure
from nanorom.plots.diagram import diagram_figure, motion_figure
from nanorom.plots.effective import effective_figure
from nanorom.plots.linear import linear_figure
from nanorom.plots.loads import load_curve
from nanorom.plots.modes import mode_gallery
from nanorom.plots.motion import animate
from nanorom.plots.peaks import peaks_figure
from nanorom.plots.reading import reading_figure
from nanorom.plots.resonances import resonance_figure
from nanorom.plots.response import amplitude_panels, comparison_figure, response_figure
from nanorom.plots.sensitivity import sensitivity_figure
from nanorom.plots.study import study_figure
from nanorom.plots.verified import verified_figure

__all__ = [
    "amplitude_panels",
    "animate",
    "basins_figure",
    "comb_figure",
    "comparison_figure",
    "device_figure",
    "diagram_figure",
    "design_figure",
    "effective_figure",
    "linear_figure",
    "load_curve",
    "mode_gallery",
    "motion_figure",
    "reading_figure",
    "peaks_figure",
    "resonance_figure",
    "response_figure",
    "sensitivity_figure",
    "study_figure",
    "verified_figure",
]
