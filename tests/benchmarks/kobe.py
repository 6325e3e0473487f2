"""The Kobe study beside the paper: fits as published, by default, with an elastic base and first link; tables
and figures of its page.

python -m tests.benchmarks.kobe          some minutes; writes docs/kobe_frf.png, docs/kobe_shapes.png and
the tables in results/pages/kobe_36dof.json
"""

from __future__ import annotations

import contextlib
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from identify.fitting.fit import Fit, fit
from identify.measured.geometry import displacements
from identify.measured.modal_tables import ModalTable
from identify.modal.analysis import analyse
from identify.model.geometry import sensor_geometry
from identify.model.modes import complex_modes
from identify.vibration.costs.base import parse_cost
from identify.vibration.costs.make_target import frf_target
from identify.vibration.costs.target import FrfTarget
from identify.vibration.given import read_frfs
from identify.vibration.plan import fit_plan
from identify.vibration.problem import Problem, load_problem
from identify.vibration.study import read_study
from identify.vibration.uncertainty import gap
from tests.benchmarks.pages import keep

ROOT = Path(__file__).parents[2]
ELASTIC = "\n  - {kind: base-compliance, axes: [rx, ry]}\n  - {kind: link-flexibility, link: link1}\n"
LINKS = ("base_link", "link1", "link2", "link3", "link4", "link5", "link6")
FITS = ["Fit", "Processor (s)", "Evaluations", "Area (Eq. 10)", "Gap", "Gap, points not fitted"]
PEAKS = (("detached", 15.0), ("whole", 10.0), ("whole", 20.0))


@dataclass(frozen=True)
class Run:
    """A fit with a name, its problem, seconds of processor time, and the targets with all points of the
    measurements.
    """

    name: str
    problem: Problem
    fit: Fit
    seconds: float
    full: dict[str, FrfTarget]


def run(name: str, text: str) -> Run:
    """Fit the study in `text`."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.yaml"
        path.write_text(text.replace("../data", str(ROOT / "data")))
        problem = load_problem(read_study(path))
        full = {}
        for m in problem.measurements[:2]:
            data = read_frfs(problem.file, m.settings)
            full[m.name] = frf_target(m.name, data, m.system, problem.points)
        began = time.process_time()
        found = fit(fit_plan(problem))
        print(f"{name}: {time.process_time() - began:.0f} s", flush=True)
        return Run(name, problem, found, time.process_time() - began, full)


def row(item: Run) -> list[str]:
    """Name, time, evaluations, area over both tests, gap, gap of the points that were not fitted."""
    targets = item.problem.targets()
    area = parse_cost("frf-area").objective(targets).costs(item.fit.values[None])[0]
    gaps = gap(targets, item.fit.values), gap(item.problem.targets("validate"), item.fit.values)
    count = sum(start.evaluations for start in item.fit.starts)
    return [item.name, f"{item.seconds:.0f}", f"{count:,}", f"{area:.1f}", f"{gaps[0]:.2f}", f"{gaps[1]:.2f}"]


def measured_modes(item: Run) -> dict[str, ModalTable]:
    """Modes of all measured points."""
    return {name: analyse(target.data).table for name, target in item.full.items()}


def nearest(frequency_hz: np.ndarray, wanted: float) -> int:
    """The mode nearest to a frequency."""
    return int(np.argmin(np.abs(frequency_hz - wanted)))


def modelled(item: Run, name: str, wanted: float) -> tuple[float, np.ndarray]:
    """Frequency and shape (points, 3), base axes, of the model's mode that moves the points most like the
    measured one near `wanted`.
    """
    target, table = item.full[name], analyse(item.full[name].data).table
    modes = complex_modes(*target.system.matrices(item.fit.values))
    assert table.shapes is not None
    seen = table.shapes[nearest(table.frequency_hz, wanted)]
    shapes = modes.shapes @ target.out.T
    mac = np.abs(shapes.conj() @ seen) ** 2 / (
        np.sum(np.abs(shapes) ** 2, axis=1) * np.sum(np.abs(seen) ** 2)
    )
    best = int(np.argmax(mac * (np.abs(np.log(modes.frequency_hz / wanted)) < 0.4)))
    like = ModalTable(
        modes.frequency_hz[[best]], modes.damping_ratio[[best]], target.data.outputs, shapes[[best]]
    )
    return float(modes.frequency_hz[best]), moved(item, name, like)[0]


def moved(item: Run, name: str, table: ModalTable) -> np.ndarray:
    """Shapes (modes, points, 3) in base axes, each turned to be real and one in Y at the struck point."""
    target = item.full[name]
    nodes = [channel.node for channel in target.data.outputs[::3]]
    geometry = sensor_geometry(target.system.site.engine, [item.problem.points[node] for node in nodes])
    shapes = displacements(geometry, table)
    return np.asarray((shapes / shapes[:, -1:, 1:2]).real)


def amplitudes(item: Run) -> list[list[str]]:
    """Amplitude of the model over the measured one, along Y, at each link's points and each peak."""
    rows = []
    for name, wanted in PEAKS:
        target = item.full[name]
        f = target.data.frequency_hz
        near = np.abs(f - wanted) < 2.5
        h, measured = target.predict(item.fit.values)[near, :, 0], target.data.frf[near, :, 0]
        cells = []
        for link in LINKS:
            chosen = [
                n
                for n, c in enumerate(target.data.outputs)
                if c.axis == 1 and item.problem.points[c.node].link == link
            ]
            if chosen:
                ratio = (
                    np.abs(h[:, chosen]).max(axis=0).mean() / np.abs(measured[:, chosen]).max(axis=0).mean()
                )
                cells.append(f"{ratio:.2f}")
        rows.append([item.name, f"{name}, {wanted:g} Hz", *cells, *[""] * (len(LINKS) - len(cells))])
    return rows


def beside_the_paper(runs: list[Run]) -> tuple[list[list[str]], list[list[str]]]:
    """Frequencies (Hz) of the modes, measured and of each fit; measured motion of each link along Y."""
    modes = [["Mode (Hz)", "Measured", *(item.name for item in runs)]]
    shapes = [["Test", "Measured (Hz)", *LINKS]]
    tables = measured_modes(runs[0])
    for name, wanted in PEAKS:
        mode = nearest(tables[name].frequency_hz, wanted)
        seen = f"{tables[name].frequency_hz[mode]:.1f}"
        modes.append(
            [f"{name}, {wanted:g}", seen, *(f"{modelled(item, name, wanted)[0]:.1f}" for item in runs)]
        )
        shape = moved(runs[0], name, replace_rows(tables[name], mode))[0]
        nodes = [channel.node for channel in runs[0].full[name].data.outputs[::3]]
        links = [runs[0].problem.points[node].link for node in nodes]
        own = {link: [n for n, one in enumerate(links) if one == link] for link in LINKS}
        cells = (f"{shape[rows, 1].mean():.2f}" if rows else "" for rows in own.values())
        shapes.append([name, seen, *cells])
    return modes, shapes


def draw_frfs(runs: list[Run], path: Path) -> None:
    """FRFs along Y at two points of each test (Figs. 12 and 13)."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(11, 6.4), sharex=True, layout="constrained")
    for ax, (name, node, label) in zip(
        axes.ravel(),
        [
            ("detached", 27, "without J4 to J6, link 3"),
            ("whole", 48, "whole arm, loading mass"),
            ("detached", 11, "without J4 to J6, link 1"),
            ("whole", 11, "whole arm, link 1"),
        ],
        strict=True,
    ):
        target = runs[0].full[name]
        channel = [f"{c.node}:{c.axis}" for c in target.data.outputs].index(f"{node}:1")
        f = target.data.frequency_hz
        ax.semilogy(f, np.abs(target.data.frf[:, channel, 0]), color="black", lw=2.2, label="measured")
        for item, style in zip(runs, ("C1-", "C0-", "C2--"), strict=True):
            ax.semilogy(
                f,
                np.abs(item.full[name].predict(item.fit.values)[:, channel, 0]),
                style,
                lw=1.2,
                label=item.name,
            )
        ax.set_title(f"{label}: point {node}, Y", fontsize=10)
        ax.grid(alpha=0.3)
    for ax in axes[1]:
        ax.set_xlabel("frequency, Hz")
    for ax in axes[:, 0]:
        ax.set_ylabel("accelerance, (m/s²)/N")
    axes[0, 0].legend(fontsize=8)
    figure.savefig(path, dpi=110)


def draw_shapes(item: Run, path: Path) -> None:
    """The first mode of the whole arm in the paper's two views (Figs. 4 and 14), and the second beside it."""
    import matplotlib.pyplot as plt

    target, table = item.full["whole"], measured_modes(item)["whole"]
    nodes = [channel.node for channel in target.data.outputs[::3]]
    geometry = sensor_geometry(target.system.site.engine, [item.problem.points[node] for node in nodes])
    links = [item.problem.points[node].link for node in nodes]
    figure, axes = plt.subplots(2, 4, figsize=(12, 6.6), height_ratios=(1, 2.6), layout="constrained")
    for pair, wanted in enumerate((10.0, 20.0)):
        mode = nearest(table.frequency_hz, wanted)
        seen = moved(item, "whole", replace_rows(table, mode))[0]
        frequency, model = modelled(item, "whole", wanted)
        for column, (shape, what) in enumerate(
            ((seen, f"measured, {table.frequency_hz[mode]:.1f} Hz"), (model, f"model, {frequency:.1f} Hz"))
        ):
            for view, (across, up, title) in enumerate(((0, 1, "X-Y plane"), (1, 2, "Y-Z plane"))):
                ax = axes[view, 2 * pair + column]
                _sketch(ax, geometry.position_m, 0.15 * shape, links, (across, up))
                ax.set_title(f"{what}, {title}", fontsize=9)
    figure.savefig(path, dpi=100)


def replace_rows(table: ModalTable, mode: int) -> ModalTable:
    """One mode of a table."""
    assert table.shapes is not None
    return ModalTable(
        table.frequency_hz[[mode]], table.damping_ratio[[mode]], table.channels, table.shapes[[mode]]
    )


def _sketch(ax: object, at: np.ndarray, shape: np.ndarray, links: list[str], plane: tuple[int, int]) -> None:
    """Points of each link joined left and right, at rest in grey and moved in colour."""
    for number, link in enumerate(LINKS):
        own = [n for n, name in enumerate(links) if name == link]
        for place, style in (
            (at, {"color": "0.75", "lw": 1}),
            (at + shape, {"color": f"C{number}", "lw": 1.6, "marker": "o", "ms": 3}),
        ):
            loop = [*own[::2], *own[1::2][::-1], own[0]]
            ax.plot(place[loop, plane[0]], place[loop, plane[1]], **style)  # type: ignore[attr-defined]
    middles = np.array(
        [(at + shape)[[n for n, name in enumerate(links) if name == link]].mean(axis=0) for link in LINKS]
    )
    ax.plot(middles[:, plane[0]], middles[:, plane[1]], "k:", lw=1)  # type: ignore[attr-defined]
    ax.set_aspect("equal")  # type: ignore[attr-defined]
    ax.set_xlabel("XYZ"[plane[0]] + ", m")  # type: ignore[attr-defined]
    ax.set_ylabel("XYZ"[plane[1]] + ", m")  # type: ignore[attr-defined]


def main() -> None:
    """All fits, tables, figures."""
    published = (ROOT / "configs" / "kobe_36dof.yaml").read_text()
    ours = (ROOT / "configs" / "kobe_36dof_defaults.yaml").read_text()
    runs = [
        run("as published", published),
        run("defaults", ours + "\nstarts: 1\n"),
        run("defaults, base and link 1 elastic", ours + ELASTIC + "\nstarts: 1\n"),
    ]
    modes, shapes = beside_the_paper(runs)
    keep(
        "kobe_36dof",
        {
            "Modes": modes,
            "Shapes": shapes,
            "Fits": [FITS, *(row(item) for item in runs)],
            "Amplitudes": [["Fit", "Peak", *LINKS], *(cells for item in runs for cells in amplitudes(item))],
        },
    )
    draw_frfs(runs, ROOT / "docs" / "kobe_frf.png")
    draw_shapes(runs[2], ROOT / "docs" / "kobe_shapes.png")


if __name__ == "__main__":
    with threadpool_limits(1), contextlib.suppress(KeyboardInterrupt):
        main()
