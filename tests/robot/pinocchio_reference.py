"""The second engine: the elastic mechanism of a URDF arm built in Pinocchio, from Pinocchio's own reading of
the file.

Every body hangs on six stacked one-coordinate joints (with JointModelComposite the gravity derivatives are
silently wrong).
"""

from __future__ import annotations

import numpy as np
import pinocchio
from numpy.typing import NDArray

Array = NDArray[np.float64]
JOINTS = (
    pinocchio.JointModelPX, pinocchio.JointModelPY, pinocchio.JointModelPZ,
    pinocchio.JointModelRX, pinocchio.JointModelRY, pinocchio.JointModelRZ,
)  # fmt: skip


class Reference:
    """M, K_g and Jacobians of a URDF arm at a posture, over the coordinates base.tx .. jointN.rz."""

    def __init__(self, urdf: str, posture: Array, base: str) -> None:
        self.rigid = pinocchio.buildModelFromXML(urdf)
        self.posture = np.concatenate(
            [
                _configuration(joint, angle)
                for joint, angle in zip(self.rigid.joints[1:], posture, strict=True)
            ]
        )
        self.rigid_data = self.rigid.createData()
        pinocchio.computeJointJacobians(self.rigid, self.rigid_data, self.posture)
        pinocchio.updateFramePlacements(self.rigid, self.rigid_data)
        self.model = pinocchio.Model()
        ground = self.rigid_data.oMf[self.rigid.getFrameId(base)]
        self.body_frames = [ground]  # pose of each body's joint frame in Pinocchio's world
        for joint in range(1, self.rigid.njoints):
            self.body_frames.append(
                self.rigid_data.oMi[joint] * pinocchio.SE3(_z_to(self._axis(joint)), np.zeros(3))
            )
        self.last = [0]  # Pinocchio's number of each body's last joint
        for number, frame in enumerate(self.body_frames):
            above = self.body_frames[number - 1].actInv(frame) if number else frame
            self.last.append(self._add_body(self.last[-1], above, number))
        self.data = self.model.createData()
        self.zero = np.zeros(self.model.nq)

    def _axis(self, joint: int) -> Array:
        local = pinocchio.getJointJacobian(self.rigid, self.rigid_data, joint, pinocchio.ReferenceFrame.LOCAL)
        return np.asarray(local[3:, joint - 1])

    def _add_body(self, parent: int, placement: pinocchio.SE3, number: int) -> int:
        for index, joint in enumerate(JOINTS):
            where = placement if index == 0 else pinocchio.SE3.Identity()
            parent = self.model.addJoint(parent, joint(), where, f"{number}.{index}")
        world = self.rigid_data.oMi[number].act(self.rigid.inertias[number])
        self.model.appendBodyToJoint(parent, self.body_frames[number].actInv(world), pinocchio.SE3.Identity())
        return parent

    def mass_matrix(self) -> Array:
        """M (n, n); only the upper triangle is filled by the engine."""
        upper = np.triu(pinocchio.crba(self.model, self.data, self.zero))
        return upper + np.triu(upper, 1).T

    def gravity_stiffness(self) -> Array:
        """K_g (n, n) from analytic derivatives."""
        return np.array(pinocchio.computeGeneralizedGravityDerivatives(self.model, self.data, self.zero))

    def coriolis(self, rates: Array) -> Array:
        """(n, n): derivative of the forces of inverse dynamics by the rates of all coordinates, where the
        drives turn at rates (joints,), rad/s.
        """
        turning = np.zeros(self.model.nv)
        turning[6 + 5 :: 6] = rates
        pinocchio.computeRNEADerivatives(self.model, self.data, self.zero, turning, np.zeros(self.model.nv))
        return np.array(self.data.dtau_dv)

    def rigid_mass_matrix(self) -> Array:
        """M (joints, joints) of the arm without elastic coordinates."""
        upper = np.triu(pinocchio.crba(self.rigid, self.rigid.createData(), self.posture))
        return upper + np.triu(upper, 1).T

    def jacobian(self, link: str, point: Array) -> Array:
        """(6, n) at a point of a link or frame, in its axes."""
        frame = self.rigid.frames[self.rigid.getFrameId(link)]
        body = frame.parentJoint
        world = self.rigid_data.oMf[self.rigid.getFrameId(link)] * pinocchio.SE3(np.eye(3), point)
        local = self.body_frames[body].actInv(world)
        joint = self.last[body + 1]
        pinocchio.computeJointJacobians(self.model, self.data, self.zero)
        own = pinocchio.getJointJacobian(self.model, self.data, joint, pinocchio.ReferenceFrame.LOCAL)
        return np.asarray(local.toActionMatrixInverse() @ own)


def _configuration(joint: pinocchio.JointModel, angle: float) -> Array:
    return (
        np.array([angle]) if joint.nq == 1 else np.array([np.cos(angle), np.sin(angle)])
    )  # continuous joints


def _z_to(axis: Array) -> Array:
    """Rodrigues' formula for the shortest turn from z to `axis`."""
    cross = np.cross([0.0, 0.0, 1.0], axis)
    if 1 + axis[2] < 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    skew = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    return np.eye(3) + skew + skew @ skew / (1 + axis[2])
