"""The torque that weight puts on joints at rest: of the robot at its link angles, and of disks hung at a
place of a link.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from identify.core.arrays import Array
from identify.core.config import Settings
from identify.joints.data import JointTestData
from identify.measured.record_files import RecordFile
from identify.robot.description import Link
from identify.robot.inverse_dynamics import RigidArm


class StaticWeights(Settings):
    """Disks on a link, their mass a column of the file; the robot is that of the study, the posture its link
    angles.
    """

    at: str = Field(description="name of the column with the mass of the disks, kg")
    link: str = Field(description="link that carries them")
    centre_m: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="where their centre is, in the link's frame"
    )

    def torque(self, file: RecordFile, bench: JointTestData, where: str) -> Array:
        """(rows, joints), N m, that the drives hold; InputError where the study has no robot or the robot no
        such link.
        """
        robot = bench.rigid(where)
        robot.link(self.link, f"{where}, key weights.link")
        angles = np.column_stack(
            [bench.column(file, bench.at("link_position", where), n, where) for n in range(bench.joints)]
        )
        mass = np.ravel(file.array(self.at))
        arm = RigidArm(robot, angles + bench.zero, np.zeros_like(angles), np.zeros_like(angles))
        return arm.torque + mass[:, None] * arm.added(
            self.link, Link("disks", 1.0, np.array(self.centre_m), np.zeros((3, 3)))
        )
