"""Pictures of modes and responses, made for a column of a paper and a slide alike."""

from nanorom.plots.modes import mode_gallery
from nanorom.plots.resonances import resonance_figure
from nanorom.plots.response import amplitude_panels, response_figure

__all__ = ["amplitude_panels", "mode_gallery", "resonance_figure", "response_figure"]
