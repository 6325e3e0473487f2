"""From hammer records to a fitted joint: a pendulum whose response is known in closed form, and data that
fail their checks.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim
from typer.testing import CliRunner

from identify.cli import app
from identify.measured.uff.write import write_uff58
from identify.setup.diagnosis import Looked
from identify.vibration.run import run_fit
from tests.model.effects.pendulum import PENDULUM
from tests.robot.random_arm import industrial_arm, write
from tests.test_study import GOOD, POINTS, _frf_set

INERTIA, WEIGHT, STIFFNESS, DAMPING = 0.2 + 3 * 0.5**2, 3 * 9.81 * 0.5, 8400.0, 4.0
RATE, SAMPLES, DECAY = 2048.0, 4096, 2.0


def _hit(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Force and acceleration at the rod's tip (lever 1 m), with noise on both: a half-sine on I a + c v + k x
    = F.
    """
    fine = np.arange(SAMPLES * 8) / (RATE * 8)
    width, peak = rng.uniform(6e-3, 9e-3), rng.uniform(80, 120)
    force = np.where(fine < width, peak * np.sin(np.pi * fine / width), 0.0)
    k = STIFFNESS + WEIGHT
    system = ([1.0, 0.0, 0.0], [INERTIA, DAMPING, k])
    _, acceleration, _ = lsim(system, force, fine)
    return force[::8] + rng.normal(size=SAMPLES) * 0.5, acceleration[::8] + rng.normal(size=SAMPLES) * 0.5


def _records(path: Path, seed: int, hits: int = 4) -> None:
    rng = np.random.default_rng(seed)
    rows = []
    for block in range(1, hits + 1):
        force, acceleration = _hit(rng)
        rows += [
            f"{block},{n / RATE!r},{f:.6g},{a:.6g}"
            for n, (f, a) in enumerate(zip(force, acceleration, strict=True))
        ]
    path.write_text("block,time_s,1:+X [N],1:+X [m/s^2]\n" + "\n".join(rows) + "\n")


CONFIG = """\
schema: identify/1
name: pendulum
robot: {{urdf: pendulum.urdf}}
points: points.csv
measurements:
  - {{file: hits1.csv, posture_deg: [0], window_decay_per_s: {decay}, estimate: {{force_window_s: 0.05}}{more}}}
band_hz: [5, 40]
effects:
  - {{kind: joint-compliance, stiffness: {{initial: 4000, bounds: [100, 1.0e+6]}}, damping: {{initial: 10, bounds: [0.1, 1000]}}}}
"""  # noqa: E501


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the robot, its point and three files of hammer records."""
    folder = tmp_path_factory.mktemp("pendulum")
    (folder / "pendulum.urdf").write_text(PENDULUM)
    (folder / "points.csv").write_text("node,name,link,x_m,y_m,z_m\n1,tip,rod,0,0,-1\n")
    for number in (1, 2, 3):
        _records(folder / f"hits{number}.csv", number)
    return folder


@pytest.mark.parametrize("more", ["", ", repeats: [hits2.csv, hits3.csv]"])
def test_stiffness_and_damping_from_hammer_records(more: str, pendulum: Path, tmp_path: Path) -> None:
    """The exponential window adds 2 1/s of decay; evaluating the model at sigma + j omega takes it out
    again.
    """
    (pendulum / "config.yaml").write_text(CONFIG.format(decay=DECAY, more=more))
    result, _ = run_fit(pendulum / "config.yaml", tmp_path / "r.h5", {"starts": 1})
    k, c = result.parameters.value
    assert k == pytest.approx(STIFFNESS, rel=2e-3)
    assert c == pytest.approx(DAMPING, rel=0.03)
    assert 0.6 < result.gap < 1.8  # one FRF with strongly correlated lines: few independent values


def test_checks_fail_with_exit_code_3_on_a_dead_channel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Data of chance, of which no set-up is to be found."""
    monkeypatch.setattr("identify.setup.check.look", lambda _: Looked(np.nan))
    write(tmp_path, industrial_arm(1))
    (tmp_path / "points.csv").write_text(POINTS)
    (tmp_path / "config.yaml").write_text(GOOD)
    data = _frf_set()
    data.frf[:, 4, 0] = 0.0
    write_uff58(tmp_path / "frf.uff", data)
    done = CliRunner().invoke(app, ["check", str(tmp_path / "config.yaml")])
    assert done.exit_code == 3
    assert "frf: fail Output 2:+Y is zero" in done.stdout
