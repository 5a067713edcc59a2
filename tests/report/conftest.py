"""A browser, and the page of the response of two modes in it."""

import itertools

import numpy as np
import pytest

from nanorom.report.viewer.listing import view
from nanorom.results.respond import respond
from nanorom.scene.drive import Drive
from nanorom.scene.excitation import Sweep
from tests.report.browser import Browser


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    browser = Browser(tmp_path_factory.mktemp("browser"))
    yield browser
    browser.close()


@pytest.fixture(scope="module")
def model(make_model):
    """Two coupled modes that fold, the second at twice the frequency of the first."""
    cubic = np.zeros((2, 2, 2, 2))
    cubic[0, 0, 0, 0], cubic[1, 1, 1, 1] = 2e16, 4e16
    for place in set(itertools.permutations((0, 0, 1, 1))):
        cubic[place] = 1e16
    frequency, mass = np.array([20e6, 41e6]), np.array([1e-16, 1e-16])
    omega = 2 * np.pi * frequency
    return make_model(
        2,
        frequency=frequency,
        mass=mass,
        stiffness=np.diag(mass * omega**2),
        damping=np.diag(mass * omega / 100),
        quadratic=np.zeros((2, 2, 2)),
        cubic=cubic,
        drive={"pressure": np.array([1e-11, 4e-12])},
        scene="[geometry]\nshape = 'disc'\n",
    )


@pytest.fixture(scope="module")
def response(model):
    drive = Drive(["2 Pa", "8 Pa"], ["0 N/m", "0 N/m"])
    return respond(model, drive, Sweep("0.8 f1", "1.5 f1"), processes=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, model, response):
    folder = tmp_path_factory.mktemp("results")
    model.save(folder / "rom.h5")
    response.save(folder / "response.h5")
    return folder


@pytest.fixture(scope="module")
def opened(browser, folder):
    """The page of the response, with its model beside it."""
    browser.open(view(folder / "response.h5"))
    yield browser
    assert browser.complaints == []
    assert browser.foreign == []
