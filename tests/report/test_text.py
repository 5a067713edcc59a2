"""What `nanorom info` prints of a model."""

import attrs
import pytest

from nanorom.report.text import model_text


@pytest.mark.parametrize(("value", "told"), [(8.682e7, "86.82 MHz"), ("?", "?")])
def test_frequencies_among_diagnostics_have_their_unit(make_model, value, told):
    model = attrs.evolve(make_model(2), diagnostics={"in_plane_frequency": value})
    (line,) = [row for row in model_text(model).splitlines() if "in_plane_freq" in row]
    assert line.split(maxsplit=1)[1] == told
