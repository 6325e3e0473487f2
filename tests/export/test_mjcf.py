"""The FRFs of an exported MJCF, from MuJoCo alone, are those of the model; what it cannot have is refused."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from identify.core.errors import InputError
from identify.export.run import Wanted, run_export
from tests.export.conftest import Result
from tests.export.model import by_solve, error, model_of

STEP = 1e-5


def matrices(path: Path, points: list[int]) -> tuple[np.ndarray, ...]:
    """M, C, K by differences of MuJoCo's forces, the sites' Jacobian, and the largest force at rest."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    size = model.nv
    mass, damping, stiffness = np.zeros((3, size, size))

    def force(position: np.ndarray, speed: np.ndarray) -> np.ndarray:
        data.qpos[:], data.qvel[:] = position, speed
        mujoco.mj_forward(model, data)
        return np.array(data.qfrc_passive - data.qfrc_bias)

    rest = np.zeros(size)
    for number, one in enumerate(STEP * np.eye(size)):
        stiffness[:, number] = (force(-one, rest) - force(one, rest)) / (2 * STEP)
        damping[:, number] = (force(rest, -one) - force(rest, one)) / (2 * STEP)
    left = float(np.abs(force(rest, rest)).max())
    mujoco.mj_fullM(model, data, mass)
    rows = []
    for node in points:
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"point{node}")
        linear = np.zeros((3, size))
        mujoco.mj_jacSite(model, data, linear, None, site)
        rows.append(data.site_xmat[site].reshape(3, 3).T @ linear)
    return mass, damping, stiffness, np.vstack(rows), left


@pytest.mark.parametrize(
    ("name", "posture"),
    [("plain", "posture2"), ("plain", "0,30,-60,0,45,0"), ("rich", None), ("shrink", None), ("lossy", None)],
)
def test_mujoco_has_the_same_frfs(result: Result, tmp_path: Path, name: str, posture: str | None) -> None:
    path = tmp_path / "arm.xml"
    run_export(result(name), Wanted("mjcf", [posture] if posture else ()), path)
    model = model_of(result(name), posture)
    mass, damping, stiffness, out, left = matrices(path, [point.node for point in model.points])
    assert left < 1e-8, "springs balance gravity at the posture"
    found, right = (
        by_solve(mass, damping, stiffness, out),
        by_solve(model.mass, model.damping, model.stiffness, model.out),
    )
    assert error(found, right) < 1e-6


def test_springs_of_joints_stay_springs_of_joints(result: Result, tmp_path: Path) -> None:
    """Beside what couples everything, such as the weight of an added mass, they keep all but a thousandth."""
    run_export(result("rich"), Wanted("mjcf"), tmp_path / "arm.xml")
    found = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    model = model_of(result("rich"))
    values = dict(zip([p.name for p in model.system.parameters], model.model.values, strict=True))
    for number in (1, 4, 5, 6):
        joint = found.joint(f"joint{number}.rz")
        assert joint.stiffness[0] == pytest.approx(values[f"joint{number}.rz.stiffness"], rel=1e-3)
        assert found.dof_damping[joint.dofadr[0]] == pytest.approx(values[f"joint{number}.rz.damping"])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("bend", r"link2\.inner_deflection_1, which bends a link"),
        ("servo", r"a negative armature at joint2\.servo \(servo\), which MuJoCo does not have"),
    ],
)
def test_what_mujoco_cannot_have_is_refused_by_name(
    result: Result, tmp_path: Path, name: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        run_export(result(name), Wanted("mjcf"), tmp_path / "arm.xml")
    assert not (tmp_path / "arm.xml").exists()
