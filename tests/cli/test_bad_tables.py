"""Tables, profiles and drives that make no sense: one line, status 1, nothing written."""

import pytest

from tests.cli.bad import SWEEP, write

TABLES = {
    "": "found no data",
    "frequency\n": "found no data",
    "g\n1 MHz\n": "found no column 'frequency'",
    "frequency\nfast\n": "line 2, frequency: found 'fast'",
    "frequency\n1 kg\n": "of another dimension",
    "frequency\n1 MHz\n-1 MHz\n2 MHz\n": "not greater than 0",
    "frequency\n1 MHz\nnan\n2 MHz\n": "need at least as many frequencies; found 2",
    "frequency\n1e400 Hz\n": "finite",
    "frequency\n1 MHz\n\n": "need at least as many",
    "frequency\n,\n": "frequency: found no number",
    "frequency (parsnips)\n1\n": "unknown unit",
    "frequency,label\n1 MHz,f01\n2 MHz,f01\n": "label: found 'f01' more than once",
    "frequency,uncertainty\n1 MHz,0\n": "line 2, uncertainty: found 0; allowed: greater than 0",
    "frequency,uncertainty\n1 MHz,\n": "line 2, uncertainty",
    'frequency\n"1 MHz\n': "need at least as many",
    "frequency\n" + "9" * 200_000 + "\n": "line 2|not a table",
    "frequency,label\n1 MHz,f01\n2 MHz,f02\n3 MHz,f99\n": "f99",
    b"\xff\xfe\x00": "found no data",
    b"\x00" * 100: "not a table of text",
}


@pytest.mark.parametrize("content", TABLES, ids=lambda content: repr(content)[:30])
def test_unsound_table_of_resonances_is_refused(tmp_path, refused, drum_toml, content):
    write(tmp_path / "measured.csv", content)
    (tmp_path / "scene.toml").write_text(drum_toml)
    refused("identify scene.toml measured.csv -o results", TABLES[content])


MEASURED = {
    "": "found no data",
    "frequency (MHz)\n20\n": "found no column 'amplitude'",
    "frequency (MHz),amplitude\n20,1\n": "amplitude: found no unit",
    "frequency (MHz),amplitude (nm)\n20,much\n": "line 2, amplitude: found 'much'",
    "frequency (MHz),amplitude (mV)\n20,nan\n": "no row has both",
    "frequency (MHz),amplitude (nm)\n0,1\n": "not greater than 0",
    "frequency (MHz),amplitude (nm),sweep\n20,1,left\n": "sweep: found 'left'; allowed: up, down",
    "frequency (Hz),amplitude (nm)\n20,1\n": "none of the frequencies",
}


@pytest.mark.parametrize("content", MEASURED, ids=lambda content: repr(content)[-30:])
def test_unsound_measured_response_is_refused(tmp_path, refused, response, content):
    write(tmp_path / "response.h5", response)
    write(tmp_path / "measured.csv", content)
    refused("plot response.h5 --data measured.csv -o pictures", MEASURED[content])


PROFILES = {
    "": "not three columns|not a table",
    "1 2 3\n": "not three columns",
    "0 0\n1 0\n0 1\n": "not three columns",
    "0 0 nan\n1 0 0\n0 1 0\n": "not three columns of finite",
    "a b c\n": "not a table of numbers",
    "0 0 0\n1 0\n": "not a table of numbers",
    "0 0 0\n1e-6 0 0\n2e-6 0 0\n": "on a line",
    "0 0 0\n1e-6 0 0\n0 1e-6 0\n": "do not cover the film",
    b"\x00\xff" * 50: "not a table of numbers",
}


@pytest.mark.parametrize("content", PROFILES, ids=lambda content: repr(content)[:30])
def test_unsound_initial_shape_is_refused(tmp_path, refused, drum_toml, content):
    write(tmp_path / "shape.txt", content)
    scene = drum_toml.replace('"10 nm"', '"10 nm"\ninitial_shape = "shape.txt"')
    rough = '[accuracy]\ndegree = 2\nmesh_size = "2 um"\n'
    (tmp_path / "scene.toml").write_text(scene + rough)
    refused("reduce scene.toml -o rom.h5", PROFILES[content])


SWEEPS = {
    "": "drive: missing section",
    "[drive]\ndirect = 1\n": "sweep: missing section",
    SWEEP + "[geometry]\n": "geometry: unknown section",
    SWEEP.replace("direct", "driect"): 'did you mean "direct"',
    SWEEP.replace('"1 mPa"', "[]"): "at least one",
    SWEEP.replace('"1 mPa"', f"{[1] * 101}"): "at most 100",
    SWEEP.replace('"1 mPa"', '["1 mPa", "1 mN"]'): r"drive.direct\[2\]: found '1 mN'",
    SWEEP.replace('"1 mPa"', '"1 mPa"\nparametric = [1, 2]\ndirect_pattern = "spot"'): "position",
    SWEEP.replace("0.98 f1", "__import__('os').system('touch pwned') f1"): "sweep.from: found",
    SWEEP.replace("0.98 f1", "f1"): "sweep.from: found 'f1'",
    SWEEP.replace("0.98 f1", "9" * 50_000 + " f1"): "sweep.from: found",
    SWEEP.replace("0.98 f1", "1e9 f1"): "sweep.from",
    SWEEP.replace("1.02 f1", "inf"): "sweep.to: found",
    b"\xff\xfe\x00": "not a text file",
    "a = " + "[" * 100_000: "not valid TOML: nested too deeply",
    "a = " + "9" * 5000: "not valid TOML: an integer of thousands of digits",
    SWEEP.replace("direct", '"\\u001b[31m"'): r"drive.\?\[31m: unknown key",
}


@pytest.mark.parametrize("content", SWEEPS, ids=lambda content: repr(content)[:40])
def test_unsound_drive_is_refused(tmp_path, refused, make_model, content):
    write(tmp_path / "sweep.toml", content)
    make_model(2).save(tmp_path / "rom.h5")
    refused("respond rom.h5 sweep.toml -o response.h5", SWEEPS[content])
