"""Every kind of mistake that is looked for.  Another one is a function that yields hypotheses, and a line."""

from __future__ import annotations

from identify.setup.hypothesis import Kind
from identify.setup.kinds import angles, bodies, channels, readout

KINDS: dict[str, Kind] = {
    "quantity": readout.quantity,
    "inverse": readout.inverse,
    "axes": readout.base_axes,
    "postures": readout.postures,
    "joint-sign": angles.signs,
    "joint-zero": angles.zeros,
    "joint-offset": angles.offsets,
    "radians": angles.radians,
    "joint-order": angles.order,
    "from-ground": angles.from_ground,
    "robot-units": bodies.units,
    "payload": bodies.payload,
    "payload-frame": bodies.payload_frame,
    "gravity": bodies.gravity,
    "window": bodies.window,
    "sensor-turned": channels.turned,
    "points-exchanged": channels.exchanged,
    "points-shifted": channels.shifted,
    "links": channels.links,
    "sizes": channels.sizes,
    "one-measurement": channels.one_measurement,
}
"""By name; where they are made is no matter, because all are judged alike."""
