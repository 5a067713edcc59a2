"""What the film's own orbits do not know is refused before anything is assembled."""

import pytest

import nanorom
from nanorom.errors import SceneError
from nanorom.verification.driven import DrivenFilm


def test_drives_of_several_harmonics_are_refused():
    drive = nanorom.Drive(direct="1 Pa", harmonics=[nanorom.Harmonic(2, direct=1)])
    with pytest.raises(SceneError, match="drive.harmonics: found some; allowed: none"):
        DrivenFilm(None, drive, 1.0, 0.0)
