"""Tables of laboratories are read as they are meant, however their programs write them."""

import numpy as np
import pytest

from nanorom.cli.main import main
from nanorom.errors import FileError
from nanorom.measurement.data import MeasuredResponse, Resonances, RingdownRecord, is_sweep

FREQUENCY = np.array([21.15e6, 35.4375e6, 36.75e6, 51.9e6])  # Hz, few digits in MHz and in Hz
AMPLITUDE = np.array([0.5e-9, 2e-9, 1.25e-9, 0.125e-9])  # m
DIALECTS = 60  # random ones
ROUNDING = 1e-12  # of decimal numbers


def dialect(random):
    """A table of FREQUENCY and AMPLITUDE as some program would write it, as bytes."""
    separator, comma = [(",", False), (";", False), (";", True), ("\t", True), (" ", True),
                        ("\t", False), (" ", False), ("  ", False)][random.integers(8)]  # fmt: skip
    place, prefix = [(1.0, "Hz"), (1e-3, "kHz"), (1e-6, "MHz")][random.integers(3)]
    height, length = [(1e9, "nm"), (1e12, "pm")][random.integers(2)]
    names = [["frequency ({})", "amplitude ({})"], ["Freq. [{}]", "R [{}]"], ["f/{}", "Mag/{}"],
             ["Frequency_{}", "Amplitude_{}"]][random.integers(4)]  # fmt: skip
    if separator.isspace() and separator != "\t":
        names = [name.replace(" ", "") for name in names]
    titles = [name.format(unit) for name, unit in zip(names, (prefix, length))]
    numbers = [FREQUENCY * place, AMPLITUDE * height]
    order = random.permutation(2)
    text = "{:.6f}" if random.integers(2) else "{:.8e}"
    rows = [[titles[i] for i in order]]
    for row in zip(*(numbers[i] for i in order)):
        cells = [text.format(value) for value in row]
        rows.append([cell.replace(".", ",") if comma else cell for cell in cells])
    rows.insert(random.integers(2, len(rows) + 1), ["nan", "-"])
    lines = [separator.join(row) for row in rows]
    if random.integers(2):
        lines[0] = "# " + lines[0]
    if random.integers(2):
        lines[0:0] = ["% measured at 20 °C, 3·10⁻⁶ mbar".replace("⁻⁶", "-6"), ""]
    lines.insert(random.integers(len(lines) - 2, len(lines)), "")
    if random.integers(2):
        lines.append("# end")
    ending = ["\n", "\r\n"][random.integers(2)]
    encoding = ["utf-8", "utf-8-sig", "latin-1", "utf-16"][random.integers(4)]
    return (ending.join(lines) + ending).encode(encoding)


@pytest.mark.parametrize("seed", range(DIALECTS))
def test_the_same_numbers_are_read_from_every_dialect(tmp_path, seed):
    path = tmp_path / "table.txt"
    path.write_bytes(dialect(np.random.default_rng(seed)))
    measured = MeasuredResponse.from_file(path)
    (trace,) = measured.traces
    assert trace.frequency == pytest.approx(FREQUENCY, rel=ROUNDING)
    assert trace.amplitude == pytest.approx(AMPLITUDE, rel=ROUNDING)
    assert (measured.unit, measured.left_out) == ("m", 1)
    assert Resonances.from_file(path).frequency == pytest.approx(FREQUENCY, rel=ROUNDING)


@pytest.fixture
def write(tmp_path):
    def write(text, name="table.csv"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    return write


def test_instruments_write_lines_before_the_names_and_units_below(write):
    text = "Model;HF2LI\nDate;2023-04-03\n\nFrequency;Amplitude R;Phase\nMHz;mV;deg\n1,5;2,5;-90\n"
    measured = MeasuredResponse.from_file(write(text))
    (trace,) = measured.traces
    assert (trace.frequency[0], trace.amplitude[0], measured.unit) == (1.5e6, 2.5, "mV")
    assert trace.phase == pytest.approx([-np.pi / 2])


def test_quadratures_are_amplitude_and_phase(write):
    (trace,) = MeasuredResponse.from_file(write("f (Hz),X (V),Y (V)\n10,3,4\n11,0,-2\n")).traces
    assert trace.amplitude == pytest.approx([5, 2])
    assert trace.phase == pytest.approx([np.arctan2(4, 3), -np.pi / 2])


def test_columns_are_named_by_the_user_where_names_do_not_tell(write):
    path = write("zz (kHz),drive amplitude (mV),amplitude 1 (nm),amplitude 2 (nm)\n5,1,2,3\n")
    with pytest.raises(FileError, match="no column 'frequency'; it has zz .*--columns frequency"):
        MeasuredResponse.from_file(path)
    with pytest.raises(FileError, match="amplitude: found drive amplitude .*say which"):
        MeasuredResponse.from_file(path, {"frequency": "zz"})
    measured = MeasuredResponse.from_file(path, {"frequency": "zz", "amplitude": "4"})
    assert measured.traces[0].amplitude == pytest.approx([3e-9])
    bare = write("5000 2\n5001 3\n", "bare.dat")
    found = MeasuredResponse.from_file(bare, {"frequency": "1", "amplitude": "2"})
    assert found.traces[0].frequency.tolist() == [5000, 5001]
    with pytest.raises(FileError, match="columns: found 'frq'; allowed: frequency"):
        MeasuredResponse.from_file(path, {"frq": "zz"})


def test_names_in_full_go_before_words_of_names(write):
    path = write("drive frequency (Hz),drive amplitude (mV),R (uV),mode\n5,1,2,f01\n")
    measured = MeasuredResponse.from_file(path)
    assert (measured.traces[0].amplitude[0], measured.unit) == (2, "uV")


@pytest.mark.parametrize(
    ("name", "level", "direction"),
    [
        ("drum_-10dBm_up.csv", "-10 dBm", "up"),
        ("m10dBm-backward.csv", "-10 dBm", "down"),
        ("sweep 2p5mV fwd.csv", "2.5 mV", "up"),
        ("drum3 20 Pa.csv", "20 Pa", ""),
        ("V12.csv", "V12", ""),
    ],
)
def test_levels_and_directions_are_read_off_names_of_files(write, name, level, direction):
    other = write("frequency (Hz),amplitude (V)\n1,2\n", "0dBm_down.csv")
    path = write("frequency (Hz),amplitude (V)\n1,2\n2,3\n", name)
    first, second = MeasuredResponse.from_files([path, other]).traces
    assert (first.level, first.direction) == (level, direction)
    assert (second.level, second.direction) == ("0 dBm", "down")


def test_files_of_two_units_are_refused(write):
    paths = [write(f"f (Hz),R ({unit})\n1,2\n", f"{unit}.csv") for unit in ("V", "nm")]
    with pytest.raises(FileError, match="found V in .*, m in .*; allowed: one unit in all files"):
        MeasuredResponse.from_files(paths)


def test_decibels_of_a_volt_are_volts_others_are_relative(write):
    path = write("f (Hz),R (dBV)\n1,-20\n2,0\n")
    assert MeasuredResponse.from_file(path).linear().traces[0].amplitude == pytest.approx([0.1, 1])
    path = write("f (Hz),S21 mag (dB)\n1,-60\n2,-20\n")
    measured = MeasuredResponse.from_file(path).linear()
    assert measured.traces[0].amplitude == pytest.approx([0.01, 1])
    assert measured.unit == "a.u., from dB"


def test_commas_beside_points_are_refused_with_both(write):
    with pytest.raises(FileError, match="frequency: found '1,5' and '1.5'; use one decimal sign"):
        MeasuredResponse.from_file(write("f (Hz);R (V)\n1,5;2\n1.5;2\n"))


def test_points_of_thousands_are_left_out(write):
    (trace,) = MeasuredResponse.from_file(write("f (Hz);R (V)\n21.150.000,5;0,5\n")).traces
    assert trace.frequency.tolist() == [21150000.5]


def test_lines_of_errors_are_those_of_the_file(write):
    with pytest.raises(FileError, match="line 5, frequency: found 'fast'"):
        Resonances.from_file(write("# a\n\nfrequency (Hz)\n1\nfast\n"))


def test_ringdowns_are_read_in_time(write):
    record = RingdownRecord.from_file(write("t (ms);R (nm)\n1;2\n0;4,5\n"))
    assert record.time == pytest.approx([0, 1e-3])
    assert record.amplitude == pytest.approx([4.5e-9, 2e-9])


def test_plot_tells_by_what_factor_it_scales(tmp_path, capsys):
    """The demo's own command; volts in place of its nanometres."""
    from tests.plots.test_data_plots import duffing

    duffing().save(tmp_path / "response.h5")
    for level in (5, 10):
        text = f"f (MHz);U (mV)\n19,9;1,5\n20,0;{level},0\n"
        (tmp_path / f"drum_{level} Pa_up.csv").write_text(text)
    paths = [str(tmp_path / f"drum_{level} Pa_up.csv") for level in (5, 10)]
    command = ["plot", str(tmp_path / "response.h5"), "--data", *paths, "--columns", "amplitude=U"]
    assert main(command) == 0
    assert "drawn with 1 mV as 0." in capsys.readouterr().err


def test_resonances_with_heights_are_no_sweeps(tmp_path):
    sweep, resonances = tmp_path / "sweep.csv", tmp_path / "resonances.csv"
    sweep.write_text("frequency (MHz),amplitude (nm)\n20,1\n21,2\n", encoding="utf-8")
    resonances.write_text("frequency (MHz),mode,amplitude (nm)\n20,f01,1\n", encoding="utf-8")
    assert is_sweep(sweep)
    assert not is_sweep(resonances)


NUMBERS = [(14.0e6, 1.0, -5.0), (14.3e6, 9.0, -90.0), (14.6e6, 2.0, -175.0)]  # Hz, nm, degrees


@pytest.mark.parametrize(
    ("head", "row", "tail"),
    [
        ("Messung bei 20 °C\nFrequenz [MHz];Amplitude [nm];Phase [°]", "{m};{a};{p}", ""),
        ("!CSV A.01\nBEGIN CH1\nFreq(Hz),S21 Log Mag(nm),S21 Phase(deg)", "{f},{a},{p}", "END"),
        ("Frequency;Amplitude;Phase", "{m} MHz;{a} nm;{p}", ";;"),
        ("  Frequency(Hz)   R(nm)   Theta(rad)", " {f:.9E}  {a:.9E}  {r:.9E}", ""),
        ("frequency,r (nm),phase", "{f},{a},{r}", ""),
    ],
)
def test_what_laboratories_write_is_read_as_they_mean_it(write, head, row, tail):
    """Signs of degrees, S parameters, farewells, units behind values, FORTRAN, radians unsaid."""
    rows = [row.format(f=f, m=f / 1e6, a=a, p=p, r=np.radians(p)) for f, a, p in NUMBERS]
    if ".9E" in row:
        rows = [text.replace("E", "D") for text in rows]
    (trace,) = MeasuredResponse.from_file(write("\n".join([head, *rows, tail]))).traces
    frequency, amplitude, phase = np.array(NUMBERS).T
    assert trace.frequency == pytest.approx(frequency, rel=1e-9)
    assert trace.amplitude == pytest.approx(1e-9 * amplitude, rel=1e-9)
    assert trace.phase == pytest.approx(np.radians(phase), rel=1e-6)


def test_a_column_for_each_level_is_a_trace_for_each(write):
    path = write("f (MHz);-20 dBm;0 dBm\n14,0;1,5;15\n14,1;2,5;nan\n", "drum_up.csv")
    first, second = MeasuredResponse.from_file(path).traces
    assert (first.level, second.level) == ("-20 dBm", "0 dBm")
    assert (first.direction, second.direction) == ("up", "up")
    assert first.amplitude.tolist() == [1.5, 2.5]
    assert (second.frequency.tolist(), second.amplitude.tolist()) == ([14e6], [15.0])
