"""Springs whose soft and stiff directions lie anywhere across z, against springs along a frame that is turned
there.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy

from identify.core.arrays import Array
from identify.core.parameters import Values
from identify.model.effects.base import parse_effect
from identify.model.effects.coupling import diagonals, first_of, from_diagonals, soft_axes
from identify.model.effects.springs import Springs
from identify.model.modes import complex_modes
from identify.model.system import assemble, build_site, list_parameters
from identify.motion.study import _spring
from identify.robot.urdf import read_urdf
from tests.arms import initial
from tests.model.effects.pendulum import DRIVE

TILT: dict[str, object] = {"kind": "joint-compliance", "axes": ["rx", "ry"]}
SOFT, STIFF, ANGLE = 300.0, 9000.0, np.radians(33.0)
_BODY = """<link name="{name}"><inertial><origin xyz="{at}" rpy="{rpy}"/><mass value="{mass}"/>
<inertia ixx="0.21" iyy="0.34" izz="0.17" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def _upright(folder: Path, turned: float) -> Path:
    """A body on a vertical joint whose frame is turned about the joint's axis; the body itself is not."""
    c, s = np.cos(turned), np.sin(turned)
    at = f"{0.11 * c} {-0.11 * s} 0.3"
    path = folder / f"upright{turned:.2f}.urdf"
    path.write_text(
        "<robot name='upright'>"
        + _BODY.format(name="ground", at="0 0 0", rpy="0 0 0", mass=50)
        + _BODY.format(name="body", at=at, rpy=f"0 0 {-turned}", mass=4)
        + "<joint name='hinge' type='continuous'><parent link='ground'/><child link='body'/>"
        + f"<origin xyz='0 0 1' rpy='0 0 {turned}'/><axis xyz='0 0 1'/></joint></robot>"
    )
    return path


def _modes(path: Path, effect: dict[str, object], coupling: tuple[Array, Array] | None = None) -> Array:
    robot, effects = read_urdf(path), [parse_effect(DRIVE), parse_effect(effect)]
    site = build_site(robot, np.zeros(1), effects)
    values = initial(list_parameters(robot, site, effects))
    if coupling is not None:
        names = [p.name for p in list_parameters(robot, site, effects)]
        for role, (x, y, xy) in zip(("stiffness", "damping"), coupling, strict=True):
            for axes, value in (("rx", x), ("ry", y), ("rx_ry", xy)):
                values[names.index(f"joint1.{axes}.{role}")] = value
    modes = complex_modes(*assemble(robot, site, effects).matrices(values))
    return np.concatenate([modes.frequency_hz, modes.damping_ratio])


def _turned(first: float, second: float) -> Array:
    c, s = np.cos(ANGLE), np.sin(ANGLE)
    return np.array(
        [first * c * c + second * s * s, first * s * s + second * c * c, (first - second) * c * s]
    )


def test_coupled_springs_are_springs_along_a_turned_frame(tmp_path: Path) -> None:
    own = {"stiffness": {"initial": [STIFF, SOFT]}, "damping": {"initial": [7.0, 0.4]}}
    turned = _modes(_upright(tmp_path, ANGLE), {**TILT, **own})
    coupling = _turned(STIFF, SOFT), _turned(7.0, 0.4)
    straight = _modes(_upright(tmp_path, 0.0), {**TILT, "coupled": True}, coupling)
    assert straight == pytest.approx(turned, rel=1e-9)
    assert _modes(_upright(tmp_path, 0.0), {**TILT, **own}) != pytest.approx(turned, rel=0.01)


def test_without_coupling_it_is_the_same_model(tmp_path: Path) -> None:
    path, base = _upright(tmp_path, 0.0), {"kind": "base-compliance", "axes": ["rx", "ry", "tz"]}
    assert _modes(path, {**base, "coupled": True}) == pytest.approx(_modes(path, base), rel=1e-12)


def test_every_start_holds_and_some_are_soft_in_each_direction(tmp_path: Path) -> None:
    effect = parse_effect({"kind": "joint-compliance", "joints": [1], "axes": ["rx", "ry"], "coupled": True})
    robot = read_urdf(_upright(tmp_path, 0.0))
    terms = effect.terms(robot, build_site(robot, np.zeros(1), [effect]), "effects.0")
    rows = effect.initial_values(terms, (2.0, 80.0))
    names = [term.parameter.name for term in terms]
    columns = [names.index(f"joint1.{axes}.stiffness") for axes in ("rx", "rx_ry", "ry")]
    squares, axes = np.linalg.eigh(rows[:, columns][:, [[0, 1], [1, 2]]])
    assert (squares > 0).all(), "a spring that pushes away is no start"
    unlike = squares[:, 1] > 5 * squares[:, 0]
    soft = np.degrees(np.arctan2(axes[unlike, 1, 0], axes[unlike, 0, 0])) % 180
    assert np.histogram(soft, bins=6, range=(0, 180))[0].min() > 0
    lower, upper = np.array([(t.parameter.lower, t.parameter.upper) for t in terms]).T
    assert ((lower <= rows) & (rows <= upper)).all()
    some = effect.initial_values(terms[-2:], (2.0, 80.0))
    assert some.shape[1] == 2, "without the springs themselves nothing can be turned"


def test_what_cannot_be_coupled_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing to couple; name rx and ry, or tx and ty"):
        parse_effect({"kind": "joint-compliance", "axes": ["rx", "ty"], "coupled": True})


def test_motion_knows_no_coupled_springs() -> None:
    with pytest.raises(ValueError, match="coupled springs have no motion yet; leave `coupled` out"):
        _spring({"kind": "joint-compliance", "axes": ["rx", "ry"], "coupled": True})


def test_held_springs_hold_their_coupling(tmp_path: Path) -> None:
    held = Values(initial=500.0, fixed=True)
    effect = parse_effect({"kind": "base-compliance", "axes": ["tx", "ty"], "coupled": True})
    assert isinstance(effect, Springs)
    effect = effect.model_copy(update={"stiffness": held})
    robot = read_urdf(_upright(tmp_path, 0.0))
    terms = effect.terms(robot, build_site(robot, np.zeros(1), [effect]), "effects.0")
    free = {term.parameter.name: term.parameter.free for term in terms}
    assert not free["base.tx_ty.stiffness"]
    assert free["base.tx_ty.damping"]


def test_variants_go_from_uncoupled_to_coupled_and_back() -> None:
    tilt = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "ry"]})
    sentences = [one.sentence() for one in tilt.variants()]
    assert sentences == [
        "tilt compliance of joint 2 (rx)",
        "tilt compliance of joint 2 (ry)",
        "tilt compliance of joint 2 (rx, ry, coupled)",
    ]
    assert tilt in tilt.variants()[-1].variants()
    assert parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rz"]}).variants() == []
    both = parse_effect({"kind": "joint-compliance", "joints": [2], "axes": ["rx", "tz"]})
    assert len(both.variants()) == 2


@pytest.mark.parametrize("angle_deg", [11.25, 22.5, 38.6, 100.0, 168.0])
def test_directions_between_axes_make_up_springs_turned_anywhere(tmp_path: Path, angle_deg: float) -> None:
    site = build_site(read_urdf(_upright(tmp_path, 0.0)), np.zeros(1), [parse_effect(TILT)])
    axes = [site.vector(f"joint1.{axis}") for axis in ("rx", "ry")]
    places = [
        (f"joint1.{axis}", "N m/rad", np.outer(v, v)) for axis, v in zip(("rx", "ry"), axes, strict=True)
    ]
    between = list(diagonals(site, places, [("rx", "ry")]))
    names = [name.removeprefix("joint1.") for name, _, _ in (*places, *between)]
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    turn = np.array([[c, -s], [s, c]])
    wanted = turn @ np.diag([1 / SOFT, 0.04 / SOFT]) @ turn.T
    plane = np.array(axes)
    columns = [(plane @ matrix @ plane.T).ravel() for _, _, matrix in (*places, *between)]
    own, left = scipy.optimize.nnls(np.array(columns).T, wanted.ravel())
    assert left < 1e-12 / SOFT
    late = {f"joint1.{name}.retardation_time": 0.01 for name in names}
    made = late | {f"joint1.{name}.compliance": value for name, value in zip(names, own, strict=True)}
    found = from_diagonals(made, "joint1", ("rx", "ry"), 0.0)
    stiffness = np.linalg.inv(wanted)
    told = [found[f"joint1.{one}.stiffness"] for one in ("rx", "ry", "rx_ry")]
    assert told == pytest.approx([stiffness[0, 0], stiffness[1, 1], stiffness[0, 1]])
    assert found["joint1.rx_ry.damping"] == pytest.approx(0.01 * stiffness[0, 1])


def test_a_place_between_axes_belongs_to_both() -> None:
    assert first_of("joint3.rx_45_ry") == "joint3.rx"
    assert first_of("link2.bending_2") == "link2.bending_2"
    assert soft_axes(["rx_112_ry", "tz"]) == ({"rx", "ry", "tz"}, True)
    assert soft_axes(["rx", "ry"]) == ({"rx", "ry"}, False)
