"""A script for MATLAB that loads the matrices (`.mat` beside it) and builds a Simulink model of them, a
State-Space block with named ports; where the toolboxes are not there, it stops at the matrices.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import ClassVar

from identify.core import atomic
from identify.core.version import VERSION
from identify.export.arrays import Mat
from identify.export.base import Exported, Format, Job

_SCRIPT = """\
% {title}
% Made by identify {version}: displacements (m) of points under forces (N) on them, about one posture.
% Run it: `model` has all matrices, `sys` the state space (Control System Toolbox), and Simulink, where it is
% there, opens a model with a State-Space block, ready for controllers, process forces or Simscape signals.
here = fileparts(mfilename('fullpath'));
model = load(fullfile(here, '{mat}'));
A = model.A{end}; B = model.B{end}; C = model.C{end}; D = model.D{end};
{notes}
if exist('ss') > 0
  sys = ss(A, B, C, D, 'InputName', cellstr(model.inputs), 'OutputName', cellstr(model.outputs));
end
if exist('new_system') > 0
  name = '{block}';
  if bdIsLoaded(name), close_system(name, 0); end
  new_system(name);
  add_block('simulink/Sources/In1', [name '/forces']);
  add_block('simulink/Continuous/State-Space', [name '/robot'], 'A', 'A', 'B', 'B', 'C', 'C', 'D', 'D');
  add_block('simulink/Sinks/Out1', [name '/displacements']);
  add_line(name, 'forces/1', 'robot/1');
  add_line(name, 'robot/1', 'displacements/1');
  set_param([name '/forces'], 'PortDimensions', num2str(size(B, 2)));
  Simulink.BlockDiagram.arrangeSystem(name);
  open_system(name);
end
"""


class Simscape(Format):
    """A script, and the matrices beside it."""

    suffix: ClassVar[str] = ".m"
    reduces: ClassVar[bool] = True

    def paths(self, path: Path) -> list[Path]:
        """The script and the matrices."""
        return [path.with_name(f"{_name(path.stem)}{path.suffix}"), path.with_suffix(".mat")]

    def write(self, job: Job) -> Exported:
        """Both files; MATLAB takes only letters, digits and underscores in names of scripts."""
        script, matrices = self.paths(job.path)
        found = Mat().write(Job(job.model, matrices, job.band_hz, job.reduced))
        text = _SCRIPT.format(
            title=job.model.name,
            version=VERSION,
            mat=matrices.name,
            end="_reduced" if job.reduced is not None else "",
            notes="\n".join(f"% {note}" for note in found.notes),
            block=_name(f"{job.path.stem}_block"),
        )
        atomic.write_text(script, text)
        return Exported([script, matrices], found.notes)


def _name(stem: str) -> str:
    safe = re.sub(r"\W", "_", stem, flags=re.ASCII)
    return safe if safe[:1].isalpha() else f"m_{safe}"
