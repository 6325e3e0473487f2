"""`identify modes`: FRFs of known modes in, the modal table, universal file, HTML and PDF out, all with the
same numbers.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import pyuff
from scipy.io import loadmat
from typer.testing import CliRunner

from identify.cli import app
from identify.core.errors import EXIT_NOT_CONVERGED, InputError, InputErrors
from identify.discovery.new_config import config_text
from identify.measured.channel import Channel
from identify.measured.frf_set import FrfSet
from identify.measured.geometry import MeasuredGeometry
from identify.measured.loaders import load_frf_set
from identify.measured.modal_tables import read_modal_table
from identify.measured.uff.geometry import geometry_text, read_geometry
from identify.measured.uff.shapes import read_shapes
from identify.measured.uff.write import write_uff58
from identify.modal.mac import mac
from identify.modal.settings import ModalSettings
from identify.modes.run import run_modes
from identify.modes.said import file_options
from identify.reports.kit.cells import Table
from identify.reports.modes import tables as modes_tables
from identify.reports.modes.sections import stabilisation
from identify.results import file as result_file
from identify.results.fit import FitResult
from identify.results.modes import ModesResult
from identify.results.provenance import sha256
from identify.vibration.problem import load_problem
from identify.vibration.provenance import study_inputs
from identify.vibration.study import read_study
from tests.hidden import write_config
from tests.reports.browser import Page, browser
from tests.reports.pdf_text import lines
from tests.reports.test_write import Tables
from tests.shared import shared

HZ, DAMPING, DECAY = np.array([12.0, 31.0, 47.5]), np.array([0.02, 0.012, 0.03]), 0.9
SHAPES = np.array([[1.0, 2.0, 3.0, 4.0], [1.0, 1.5, 0.2, -1.2], [1.0, -0.5, -0.8, 0.9]])
NODES = (1, 2, 3, 4)


def frf_set(noise: float = 0.003, modes: int = 3) -> FrfSet:
    """Accelerances in closed form, sum of phi_i phi_j s^2 / (s^2 + 2 zeta omega s + omega^2), at sigma + j
    omega, with white noise.
    """
    frequency = np.arange(4.0, 60.0, 0.125)
    s = DECAY + 2j * np.pi * frequency[:, None, None]
    frf = np.zeros((len(frequency), 4, 2), dtype=complex)
    for hz, zeta, shape in zip(HZ[:modes], DAMPING, SHAPES, strict=False):
        w = 2 * np.pi * hz
        frf += np.outer(shape, shape[[0, 3]]) * s**2 / (s**2 + 2 * zeta * w * s + w**2) / 10
    rng = np.random.default_rng(4)
    level = noise if modes == 0 else noise * np.sqrt(np.mean(np.abs(frf) ** 2))
    frf = frf + level * (rng.normal(size=frf.shape) + 1j * rng.normal(size=frf.shape))
    outputs = tuple(Channel(node, 3) for node in NODES)
    return FrfSet(frequency, frf, outputs, (outputs[0], outputs[3]), "accelerance", source="closed form")


def write_data(path: Path, with_geometry: bool, modes: int = 3) -> Path:
    write_uff58(path, frf_set(modes=modes))
    if with_geometry:
        position = np.array([[0.0, 0.0, 0.1], [0.3, 0.0, 0.1], [0.6, 0.1, 0.1], [0.9, 0.1, 0.2]])
        geometry = MeasuredGeometry(NODES, position, np.tile(np.eye(3), (4, 1, 1)), ((1, 2, 3, 4),))
        path.write_bytes(geometry_text(geometry).encode() + path.read_bytes())
    return path


def invoke(*arguments: object) -> Any:
    return CliRunner().invoke(app, ["modes", *map(str, arguments)])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("modes")
    data = write_data(folder / "beam.uff", with_geometry=True)
    said = invoke(data, "--window-decay", DECAY, "--band", 5, 58, "--out", folder / "beam_modes.h5")
    assert said.exit_code == 0, said.output
    for suffix in (".h5", ".yaml", ".uff", ".html", ".pdf"):
        assert f"beam_modes{suffix}" in said.output.replace("\n", "")
    assert "3 modes were found" in said.output
    return folder / "beam_modes.h5"


@pytest.fixture(scope="module")
def result(run: Path) -> ModesResult:
    return result_file.read(run, ModesResult)


def test_the_modes_are_found_and_the_window_is_taken_out(result: ModesResult) -> None:
    m = result.measurements["beam"]
    np.testing.assert_allclose(m.modes.frequency_hz, HZ, rtol=2e-4)
    np.testing.assert_allclose(m.modes.damping_ratio, DAMPING, rtol=0.01)
    # A pole moved by the decay: Re(lambda) - sigma, by hand.
    w = 2 * np.pi * HZ
    moved = -DAMPING * w - DECAY + 1j * w * np.sqrt(1 - DAMPING**2)
    np.testing.assert_allclose(m.modes.seen_damping_ratio, -moved.real / np.abs(moved), rtol=0.01)
    assert np.diag(mac(m.modes.shapes, SHAPES)) == pytest.approx(1, abs=1e-3)
    assert m.total_error < 0.02
    assert m.modes.auto_mac == pytest.approx(mac(SHAPES, SHAPES), abs=0.01)
    assert np.sum(m.diagram.stable) > 3 * 0.4 * m.highest_order
    assert "exponential window (0.9 1/s)" in result.verdict[0]


def test_shapes_are_on_the_geometry(result: ModesResult) -> None:
    m = result.measurements["beam"]
    assert m.shapes is not None and m.geometry is not None and m.geometry.segments is not None
    assert m.geometry.segments.tolist() == [[0, 1], [1, 2], [2, 3]]
    assert m.shapes[:, :, :2] == pytest.approx(0)
    np.testing.assert_array_equal(m.shapes[:, :, 2], m.modes.shapes)


def test_the_format_is_an_option_and_the_error_names_it(tmp_path: Path) -> None:
    data = write_data(tmp_path / "beam.dat", with_geometry=True)
    said = invoke(data)
    assert isinstance(said.exception, InputError)
    assert "add `--format`, such as `--format uff`" in str(said.exception)
    words = ("--window-decay", DECAY, "--out", tmp_path / "m.h5", "--no-report")
    assert invoke(data, "--format", "uff", *words).exit_code == 0
    found = result_file.read(tmp_path / "m.h5", ModesResult).measurements["beam"]
    assert found.geometry is not None


def test_channels_are_chosen_and_names_of_arrays_refused(tmp_path: Path) -> None:
    data = write_data(tmp_path / "a.uff", with_geometry=False)
    words = ("--window-decay", DECAY, "--out", tmp_path / "m.h5", "--no-report")
    assert invoke(data, "--outputs", "2:+Z,4:+Z", "--inputs", "1:+Z", *words).exit_code == 0
    assert result_file.read(tmp_path / "m.h5", ModesResult).measurements["a"].modes.channels == (
        "2:+Z",
        "4:+Z",
    )
    with pytest.raises(InputError, match=r"channel 9:\+Z is not in the file"):
        run_modes(data, tmp_path / "n.h5", file_options(outputs=["9:+Z"]))
    with pytest.raises(InputError, match=r"`--variable`\) beside a file that has none"):
        run_modes(data, tmp_path / "n.h5", file_options(variables={"frf": "x"}))


def test_the_help_shows_a_band_as_it_is_given() -> None:
    assert "--band LOW HIGH" in invoke("--help").output


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("frf_and_mic_node_minus1.uff", "type 1 (time response) was not read"),
        ("frf_and_pressure_per_force.uff", "unit 'Pa' is neither"),
        ("frf_one_record_shorter.uff", "of 120 lines the 112"),
        ("frf_nan_at_dc.csv", "the line at 0 Hz was left out"),
        ("frf_conjugated.uff", "phases turn the wrong way"),
        ("frf_good.uff", "no geometry was given"),
    ],
)
def test_reported_files_give_their_three_modes_and_a_note(name: str, said: str, tmp_path: Path) -> None:
    result, _ = run_modes(shared("reported", name), tmp_path / "m.h5")
    (found,) = result.measurements.values()
    np.testing.assert_allclose(found.modes.frequency_hz, [12, 27, 41], rtol=2e-4)
    np.testing.assert_allclose(found.modes.damping_ratio, [0.012, 0.015, 0.01], rtol=0.01)
    assert any(said in note for note in result.notes)


def test_modal_a_of_the_universal_file_makes_the_residues(run: Path) -> None:
    """Another reader's poles, shapes and modal A give back the FRFs: psi psi^T / (a (s - lambda))."""
    sets = [one for one in pyuff.UFF(str(run.with_suffix(".uff"))).read_sets() if one["type"] == 55]
    data = frf_set()
    s = (DECAY + 2j * np.pi * data.frequency_hz)[:, None]
    rebuilt = np.zeros((len(data.frequency_hz), 4), dtype=complex)
    for one in sets:
        residue = one["r3"] * one["r3"][0] / one["modal_a"]
        for pole, part in ((one["eig"], residue), (np.conj(one["eig"]), residue.conj())):
            rebuilt += part / (s - pole)
    rebuilt *= s**2
    near = np.abs(data.frequency_hz[:, None] - HZ).min(axis=1) < 1
    error = np.abs(rebuilt - data.frf[:, :, 0])[near].max() / np.abs(data.frf).max()
    assert error < 0.05
    table = read_modal_table(run.with_suffix(".yaml"))
    np.testing.assert_array_equal(table.modal_mass_kg, 1)


def test_the_table_and_the_shapes_come_back(run: Path, result: ModesResult) -> None:
    kept = result.measurements["beam"].modes
    table, shapes = read_modal_table(run.with_suffix(".yaml")), read_shapes(run.with_suffix(".uff"))
    for read, tolerance in ((table, 1e-12), (shapes, 2e-5)):
        np.testing.assert_allclose(read.frequency_hz, kept.frequency_hz, rtol=tolerance)
        np.testing.assert_allclose(read.damping_ratio, kept.damping_ratio, rtol=10 * tolerance)
        assert read.shapes == pytest.approx(kept.shapes, rel=tolerance, abs=1e-9)
    np.testing.assert_array_equal(table.damping_std, kept.damping_std)
    assert read_geometry(run.with_suffix(".uff")).lines == ((1, 2, 3, 4),)


def _printed(result: ModesResult) -> list[Table]:
    m = next(iter(result.measurements.values()))
    return [
        modes_tables.mode_table(m),
        modes_tables.measurement_table(result),
        modes_tables.error_table(result),
    ]


def test_html_pdf_and_file_have_the_same_numbers(run: Path, result: ModesResult) -> None:
    rows = Tables(run.with_suffix(".html").read_text("utf-8")).rows
    printed = [re.sub(r"\s+", " ", line).strip() for line in lines(run.with_suffix(".pdf"))]
    for table in _printed(result):
        for row in table.rows:
            assert list(row) in rows, table.title
            numbers = [cell for cell, column in zip(row, table.columns, strict=True) if column.numeric]
            assert any(all(cell in line.split(" ") for cell in numbers) for line in printed), (
                table.title,
                row,
            )
    with h5py.File(run) as file:
        stored = file["measurements/beam/modes"]
        for row, hz, damping in zip(
            _printed(result)[0].rows, stored["frequency_hz"], stored["damping_ratio"], strict=True
        ):
            assert float(row[1]) == pytest.approx(hz, rel=5.1e-6)
            assert float(row[3]) == pytest.approx(100 * damping, rel=5.1e-4)


def test_reports_again_are_the_same_bytes(run: Path) -> None:
    before = [run.with_suffix(suffix).read_bytes() for suffix in (".html", ".pdf")]
    assert CliRunner().invoke(app, ["report", str(run)]).exit_code == 0
    assert [run.with_suffix(suffix).read_bytes() for suffix in (".html", ".pdf")] == before


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with browser() as opened:
        yield opened


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_the_page_draws_moves_and_picks_in_silence(page: Page, run: Path, dark: bool) -> None:
    page.console.clear()
    page.requests.clear()
    page.open(run.with_suffix(".html"), dark=dark)
    page.run("drawAll()")
    page.wait("[...document.querySelectorAll('.plot')].every(plot => plot.querySelector('.main-svg'))")
    drawn = "p.querySelector('.scatterlayer .trace, .heatmaplayer image')"
    assert page.run(f"[...document.querySelectorAll('.plot')].filter(p => !{drawn}).map(p => p.id)") == []
    assert page.run("document.documentElement.scrollWidth <= innerWidth"), "nothing sticks out"
    picture = "$('robot-measured').toDataURL()"
    first = page.run(picture)
    page.wait(f"{picture} !== {first!r}")
    page.run("$('robot-play').click()")
    still = page.run(picture)
    time.sleep(0.2)
    assert page.run(picture) == still
    page.run("$('robot-mode').selectedIndex = 1; $('robot-mode').dispatchEvent(new Event('change'))")
    assert page.run(picture) != still
    page.run("{ const e = $('frf-output'); e.value = '2:+Z'; e.dispatchEvent(new Event('change')); }")
    page.wait("$('frf-title').textContent.includes('2:+Z / ')")
    assert page.run("$('frf-plot').data.map(t => t.name)") == ["measured", "rebuilt from the modes"] * 2
    assert page.console == []
    assert all(address.startswith(("file:", "data:", "blob:")) for address in page.requests)


def test_without_geometry_the_report_says_so(tmp_path: Path, page: Page) -> None:
    data = write_data(tmp_path / "bare.uff", with_geometry=False)
    out = tmp_path / "out.h5"
    said = invoke(
        data, "--window-decay", DECAY, "--mode", 12.05, "--mode", 47.4, "--max-order", 16, "--out", out
    )
    assert said.exit_code == 0, said.output
    kept = result_file.read(out, ModesResult)
    np.testing.assert_allclose(kept.measurements["bare"].modes.frequency_hz, HZ[[0, 2]], rtol=2e-3)
    assert "shapes are not drawn" in kept.notes[0]
    page.console.clear()
    page.open(out.with_suffix(".html"))
    assert page.run("$('robot').textContent").count("Shapes are not drawn") == 1
    assert page.console == []


def test_a_geometry_without_unit_is_left_out_unless_the_unit_is_given(tmp_path: Path) -> None:
    data = write_data(tmp_path / "a.uff", with_geometry=True)
    units, mark = data.read_bytes(), b"    -1\n"
    data.write_bytes(units[units.index(mark, len(mark)) + len(mark) :])  # dataset 164 comes first
    kept, _ = run_modes(data, tmp_path / "a_modes.h5", modal={"max_order": 12})
    assert kept.measurements["a"].geometry is None and "--length-unit" in kept.notes[0]
    kept, _ = run_modes(data, tmp_path / "a_modes.h5", modal={"max_order": 12}, length_unit="mm")
    geometry = kept.measurements["a"].geometry
    assert geometry is not None and geometry.points.max() == pytest.approx(0.9e-3)


def test_frfs_that_the_modes_do_not_rebuild_end_with_a_way_out(tmp_path: Path) -> None:
    spectra = loadmat(shared("data", "pydvma_ruler", "ruler_grid_acc_3.mat"))["yspec"][:4100]
    lines_hz = np.arange(len(spectra)) * 20_000 / 32_768
    points = tuple(Channel(k + 1, 3) for k in range(spectra.shape[1]))
    ruler = FrfSet(lines_hz, spectra[:, :, None], points, points[:1], "accelerance", source="ruler")
    data = tmp_path / "ruler.uff"
    write_uff58(data, ruler)
    wide = ["--band", 1, 1250, "--max-order", 24]
    said = invoke(data, *wide, "--out", tmp_path / "whole.h5", "--no-report", "--quiet")
    whole = result_file.read(tmp_path / "whole.h5", ModesResult)
    for peak in (39, 108, 212, 352, 551):
        assert np.min(np.abs(whole.measurements["ruler"].modes.frequency_hz - peak)) < 1, peak
    assert whole.measurements["ruler"].parts > 1
    assert "parts of the band" in whole.verdict[0]
    narrow = ["--band", 1500, 2500, "--max-order", 4]
    said = invoke(data, *narrow, "--out", tmp_path / "poor.h5", "--no-report", "--quiet")
    assert said.exit_code == EXIT_NOT_CONVERGED
    assert "do not rebuild the FRFs: narrow the band with `--band`" in said.output
    kept = result_file.read(tmp_path / "poor.h5", ModesResult)
    assert kept.found > 0 and kept.measurements["ruler"].total_error > 0.5
    said = invoke(data, "--band", 20, 600, "--out", tmp_path / "low.h5", "--no-report", "--quiet")
    assert said.exit_code == 0, said.output
    low = result_file.read(tmp_path / "low.h5", ModesResult).measurements["ruler"]
    for peak in (39, 108, 212, 352, 551):
        assert np.min(np.abs(low.modes.frequency_hz - peak)) < 1, peak
    assert low.total_error < 0.2


def test_noise_alone_has_no_modes(tmp_path: Path) -> None:
    data = write_data(tmp_path / "noise.uff", with_geometry=False, modes=0)
    said = invoke(data, "--out", tmp_path / "noise_modes.h5", "--quiet")
    assert said.exit_code == EXIT_NOT_CONVERGED
    assert "no mode was found" in said.output
    assert sorted(path.name for path in tmp_path.glob("noise_modes*")) == [
        "noise_modes.h5",
        "noise_modes.html",
        "noise_modes.pdf",
    ]


def test_bad_input_is_refused(tmp_path: Path) -> None:
    data = write_data(tmp_path / "a.uff", with_geometry=True)
    before = data.read_bytes()
    for keywords, words in (
        ({"modal": {"estimator": "esprit"}}, "estimator: found 'esprit'"),
        ({"modal": {"direction": "X"}}, "no response channel"),
        ({"modal": {"band_hz": (300, 200)}}, "band_hz"),
        ({"length_unit": "parsec"}, "one of m, mm"),
        ({"out": tmp_path / "a.uff"}, "suffix"),
        ({"out": tmp_path / "a.h5"}, "would be overwritten"),
        ({"geometry": tmp_path / "none.uff"}, "cannot be read"),
    ):
        with pytest.raises(InputError, match=re.escape(words)):
            run_modes(data, **{"out": tmp_path / "b.h5", **keywords})  # type: ignore[arg-type]
    assert data.read_bytes() == before
    points = tmp_path / "points.uff"
    points.write_bytes(before)
    with pytest.raises(InputError, match=r"points\.uff: not a file for modes: an input, which would be over"):
        run_modes(data, tmp_path / "points.h5", geometry=points)
    assert points.read_bytes() == before
    with pytest.raises(InputError, match="cannot be read"):
        run_modes(tmp_path / "no.uff", tmp_path / "b.h5")
    other = tmp_path / "other.uff"
    other.write_text(geometry_text(MeasuredGeometry((7,), np.zeros((1, 3)), np.eye(3)[None])))
    with pytest.raises(InputError, match="without any measured point"):
        run_modes(data, tmp_path / "b.h5", geometry=other)
    assert not (tmp_path / "b.h5").exists()


def test_a_modes_file_is_no_fit_and_the_other_way_round(run: Path) -> None:
    with pytest.raises(InputError, match="holds a modal analysis; expected a finished fit"):
        result_file.read(run, FitResult)
    assert result_file.kind_of(run) == "modes"
    assert result_file.kind_of(run.with_suffix(".yaml")) == ""


def test_a_study_gives_posture_and_settings_and_takes_the_table_back(tmp_path: Path) -> None:
    config = write_config("none_101", tmp_path, extra="modal: {max_order: 14}")
    kept, written = run_modes(config, tmp_path / "arm_modes.h5")
    assert list(kept.measurements) == ["posture1", "posture2", "posture3"]
    m = kept.measurements["posture1"]
    assert m.highest_order == 14 and m.posture_deg.shape == (6,) and m.frf.window_decay_per_s > 0
    assert m.geometry is not None and m.geometry.skeleton.shape[1] == 3 and m.shapes is not None
    table = next(path for path in written if path.name == "arm_modes_posture1.yaml")
    text = config.read_text()
    start, end = text.index("measurements:"), text.index("band_hz")
    entry = f"measurements:\n  - {{modes: '{table}', posture_deg: {m.posture_deg.tolist()}}}\n"
    again = tmp_path / "from_modes.yaml"
    again.write_text(text[:start] + entry + text[end:])
    target = load_problem(read_study(again)).measurements[0].target
    np.testing.assert_array_equal(target.data.frequency_hz, m.modes.frequency_hz)
    with pytest.raises(InputError, match="options for a data file beside a study"):
        run_modes(config, tmp_path / "x.h5", length_unit="m")
    with pytest.raises(InputError, match="no measurement with FRFs"):
        run_modes(again, tmp_path / "x.h5")


def test_a_study_names_a_file_of_choices_that_its_own_keys_override(tmp_path: Path) -> None:
    (tmp_path / "arm_posture2.yaml").write_text("max_order: 12\nmin_presence: 0.3\nband_hz: [5, 40]\n")
    config = write_config(
        "none_101", tmp_path, extra="modal_choices: arm_posture2.yaml\nmodal: {max_order: 14}"
    )
    file = read_study(config)
    assert file.study.modal == ModalSettings(max_order=14, min_presence=0.3, band_hz=(5, 40))
    assert ("arm_posture2.yaml", sha256(tmp_path / "arm_posture2.yaml")) in study_inputs(file)
    assert "modal_choices: ../arm_posture2.yaml" in config_text(file, [], {}, tmp_path / "elsewhere")
    with pytest.raises(InputError, match="would be overwritten"):
        run_modes(config, tmp_path / "arm.h5")
    (tmp_path / "arm_posture2.yaml").write_text("max_order: 12\ndrop: [5]\n")
    with pytest.raises(InputErrors, match=r"posture2.yaml line 2: drop: .*unknown key.*mean `drop_hz`"):
        read_study(config)
    (tmp_path / "arm_posture2.yaml").unlink()
    with pytest.raises(InputError, match=r"arm_posture2.yaml \(modal_choices in .*line"):
        read_study(config)


def test_the_diagram_marks_what_choices_did(tmp_path: Path) -> None:
    data, out = write_data(tmp_path / "a.uff", with_geometry=False), tmp_path / "a_modes.h5"
    given = (data, "--window-decay", DECAY, "--band", 5, 58, "--out", out, "--no-report")
    assert invoke(*given).exit_code == 0
    plain = result_file.read(out, ModesResult).measurements["a"].diagram
    assert plain.marked() == [] or [name for name, _ in plain.marked()] == ["below the threshold"]
    assert invoke(*given, "--keep", 12.0, "--drop", 31.0).exit_code == 0
    chosen = result_file.read(out, ModesResult).measurements["a"]
    marked = dict(chosen.diagram.marked())
    for name, hz in (("kept by hand", 12.0), ("dropped by hand", 31.0)):
        assert marked[name].sum() > 5
        assert chosen.diagram.frequency_hz[marked[name]] == pytest.approx(hz, rel=0.02)
    assert invoke(*given, "--threshold", 0.9).exit_code in {0, 4}
    diagram = result_file.read(out, ModesResult).measurements["a"].diagram
    below = dict(diagram.marked())["below the threshold"]
    assert below.sum() > 5
    assert diagram.stable[below].all()  # a cluster, and not what else is as near to a wide one
    figure = stabilisation(chosen)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"kept by hand", "dropped by hand"} <= set(labels)


def test_an_unknown_setting_of_the_analysis_is_named(tmp_path: Path) -> None:
    config = write_config("none_101", tmp_path, extra="modal: {max_ordr: 14}")
    with pytest.raises(InputErrors, match="did you mean `max_order`"):
        run_modes(config, tmp_path / "x.h5")


def test_frfs_are_exported_as_they_were_analysed_and_as_the_modes_rebuild_them(tmp_path: Path) -> None:
    data, out = write_data(tmp_path / "a.uff", with_geometry=False), tmp_path / "a_modes.h5"
    said = invoke(data, "--window-decay", DECAY, "--band", 6, 50, "--frfs", "--out", out, "--no-report")
    assert said.exit_code == 0, said.output
    kept, rebuilt = (load_frf_set(tmp_path / f"a_modes_{name}.uff") for name in ("frfs", "rebuilt"))
    lines = (frf_set().frequency_hz >= 6) & (frf_set().frequency_hz <= 50)
    assert kept.quantity == rebuilt.quantity == "accelerance"
    assert np.max(np.abs(kept.frf - load_frf_set(data).frf[lines])) == 0
    exact = frf_set(noise=0.0).frf[lines]
    errors = [np.linalg.norm(one.frf - exact) / np.linalg.norm(exact) for one in (kept, rebuilt)]
    assert errors[1] < 0.3 * errors[0] < 0.3 * 0.01


def test_choices_come_from_a_file_that_the_command_line_overrides(tmp_path: Path) -> None:
    data, choices = write_data(tmp_path / "a.uff", with_geometry=False), tmp_path / "mine.yaml"
    choices.write_text("band_hz: [6, 50]\ndrop_hz: [31.0]\n")
    out = tmp_path / "a_modes.h5"
    given = (data, "--window-decay", DECAY, "--out", out, "--no-report", "--choices", choices)
    assert invoke(*given).exit_code == 0
    found = read_modal_table(tmp_path / "a_modes.yaml").frequency_hz
    assert found == pytest.approx([12.0, 47.5], rel=2e-3)
    assert invoke(*given, "--band", 6, 40).exit_code == 0
    found = read_modal_table(tmp_path / "a_modes.yaml").frequency_hz
    assert found == pytest.approx([12.0], rel=2e-3)
    choices.write_text("band_hz: [6, 50]\ndrop: [31.0]\n")
    assert isinstance(invoke(*given).exception, InputErrors)
    with pytest.raises(InputErrors, match=r"mine.yaml.*line 2.*drop.*unknown key"):
        run_modes(data, out, choices=choices)
    assert choices.read_text().endswith("drop: [31.0]\n")
    with pytest.raises(InputError, match="would be overwritten"):
        choices.write_text("drop_hz: [31.0]\n")
        run_modes(data, tmp_path / "mine.h5", choices=choices)


def test_aircraft_from_the_command(tmp_path: Path) -> None:
    data = shared("data", "uliege_aircraft", "aircraft_converted.uff")
    out = tmp_path / "aircraft.h5"
    said = invoke(
        data,
        "--unit",
        "m/s^2/N",
        "--length-unit",
        "m",
        "--band",
        10,
        100,
        "--max-order",
        14,
        "--out",
        out,
        "--no-report",
    )
    assert said.exit_code == 0, said.output
    m = result_file.read(out, ModesResult).measurements["aircraft_converted"]
    assert len(m.modes.frequency_hz) >= 5 and m.shapes is not None
    assert m.geometry is not None
    still = np.isnan(m.shapes).any(axis=(0, 2))
    assert still.sum() == len(m.geometry.nodes) - len({channel.split(":")[0] for channel in m.modes.channels})


def test_measured_accelerances_from_columns(tmp_path: Path) -> None:
    """Three FRFs that are shared as columns of numbers, in a universal file."""
    paths = [shared("data", "pyuff_measured_uff", f"meas_point_{n}.txt") for n in (1, 2, 3)]
    columns = [[complex(line) for line in path.read_text().split()] for path in paths]
    frf = np.array(columns).T[:, :, None]
    sensors = tuple(Channel(n, 3) for n in (1, 2, 3))
    data = tmp_path / "points.uff"
    write_uff58(data, FrfSet(np.arange(1001.0), frf, sensors, (Channel(4, 3),), "accelerance"))
    said = invoke(data, "--band", 10, 1000, "--out", tmp_path / "p_modes.h5", "--no-report")
    assert said.exit_code == 0, said.output
    found = read_modal_table(tmp_path / "p_modes.yaml").frequency_hz
    for peak in (52, 142, 279, 460, 687, 959):
        assert np.min(np.abs(found - peak)) < 1


@pytest.mark.parametrize(
    ("options", "told"),
    [({}, False), ({"window_decay_per_s": 0.0}, True), ({"window_decay_per_s": 2.0}, True)],
)
def test_a_window_that_nobody_told_is_asked_for(
    options: dict[str, float], told: bool, tmp_path: Path
) -> None:
    write_uff58(tmp_path / "x.uff", frf_set())
    result, _ = run_modes(tmp_path / "x.uff", tmp_path / "m.h5", file_options(**options))
    assert any("no exponential window was stated" in note for note in result.notes) != told


def test_only_modes_inside_the_band_are_listed(tmp_path: Path) -> None:
    """The mode at 31 Hz has a half-power band of 0.75 Hz: its flank is in a band from 31.2 Hz on."""
    write_uff58(tmp_path / "x.uff", frf_set())
    file = file_options(window_decay_per_s=DECAY)
    for band, inside in (((31.2, 55.0), HZ[2:]), ((20.0, 47.2), HZ[1:2]), ((20.0, 55.0), HZ[1:])):
        result, _ = run_modes(
            tmp_path / "x.uff", tmp_path / f"{band[0]}{band[1]}.h5", file, {"band_hz": band}
        )
        [found] = result.measurements.values()
        np.testing.assert_allclose(found.modes.frequency_hz, inside, rtol=1e-3)
        assert found.total_error < 0.02, "what is left of a flank is a residual"
