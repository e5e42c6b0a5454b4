"""Gravity and friction feed-forward, as a C header and as a Python function without any dependency.

Both are one algorithm: the frames of the joints from base to tip, then the gravity of what each joint
carries, summed from tip to base as force and moment about the joint's origin.
"""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap
from typing import Any

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.found import BODIES, TILT
from daq.exporting.elsewhere.frames import joint_frames

_C = """/* {heading}
 *
 * {name}_gravity: torque that holds the arm still at positions q, offsets included.
 * {name}_friction: torque against friction at velocities dq.
 * Their sum is the feed-forward; add it to the torque command at the joints. SI units: rad, N*m (m, N on
 * linear axes). No state, no allocation, C99; needs -lm.
 *
 * Not in it:
 * - Inertia and velocity products.
{lost} */
#ifndef {guard}_FEED_FORWARD_H
#define {guard}_FEED_FORWARD_H
#include <math.h>

#define {guard}_JOINTS {n}

static const double {name}_rotation[{n}][9] = {rotation};
static const double {name}_origin[{n}][3] = {origin};
static const double {name}_axis[{n}][3] = {axis};
static const int {name}_prismatic[{n}] = {prismatic};
static const double {name}_mass[{n}] = {mass};
static const double {name}_moment[{n}][3] = {moment}; /* mass times centre, in the joint's frame */
static const double {name}_world[3] = {gravity}; /* gravity in the base */
static const double {name}_offset[{n}] = {offset};
static const double {name}_viscous[{n}] = {damping};
static const double {name}_coulomb[{n}] = {friction};
{couplings}
static const double {name}_width = {width}; /* rad/s; 0 is the exact sign */

static inline double {name}_sign(double speed) {{
  if ({name}_width > 0.0) return tanh(speed / {name}_width);
  return (speed > 0.0) - (speed < 0.0);
}}

static inline void {name}_gravity(const double q[{n}], double tau[{n}]) {{
  double frame[{n}][9], place[{n}][3], axis[{n}][3];
  double force[3] = {{0, 0, 0}}, moment[3] = {{0, 0, 0}};
  int j, r, c, k;
  for (j = 0; j < {n}; ++j) {{
    const double *z = {name}_axis[j];
    double turn[9] = {{1, 0, 0, 0, 1, 0, 0, 0, 1}}, fixed[9], shift[3] = {{0, 0, 0}};
    if ({name}_prismatic[j]) {{
      for (r = 0; r < 3; ++r) shift[r] = q[j] * z[r];
    }} else {{
      const double s = sin(q[j]), v = 1.0 - cos(q[j]);
      const double cross[9] = {{0, -z[2], z[1], z[2], 0, -z[0], -z[1], z[0], 0}};
      for (r = 0; r < 3; ++r)
        for (c = 0; c < 3; ++c) {{
          double square = 0.0;
          for (k = 0; k < 3; ++k) square += cross[3 * r + k] * cross[3 * k + c];
          turn[3 * r + c] += s * cross[3 * r + c] + v * square;
        }}
    }}
    for (r = 0; r < 3; ++r) {{
      place[j][r] = j ? place[j - 1][r] : 0.0;
      for (c = 0; c < 3; ++c) {{
        fixed[3 * r + c] = 0.0;
        for (k = 0; k < 3; ++k)
          fixed[3 * r + c] += (j ? frame[j - 1][3 * r + k] : (r == k)) * {name}_rotation[j][3 * k + c];
        place[j][r] += (j ? frame[j - 1][3 * r + c] : (r == c)) * {name}_origin[j][c];
      }}
    }}
    for (r = 0; r < 3; ++r) {{
      axis[j][r] = 0.0;
      for (c = 0; c < 3; ++c) {{
        place[j][r] += fixed[3 * r + c] * shift[c];
        axis[j][r] += fixed[3 * r + c] * z[c];
        frame[j][3 * r + c] = 0.0;
        for (k = 0; k < 3; ++k) frame[j][3 * r + c] += fixed[3 * r + k] * turn[3 * k + c];
      }}
    }}
  }}
  for (j = {n} - 1; j >= 0; --j) {{
    double arm[3] = {{0, 0, 0}}, weight[3];
    for (r = 0; r < 3; ++r) {{
      for (c = 0; c < 3; ++c) arm[r] += frame[j][3 * r + c] * {name}_moment[j][c];
      weight[r] = -{name}_mass[j] * {name}_world[r];
    }}
    /* moment about this joint's origin: of this link, and of all beyond it */
    for (r = 0; r < 3; ++r) {{
      const int a = (r + 1) % 3, b = (r + 2) % 3;
      moment[r] -= arm[a] * {name}_world[b] - arm[b] * {name}_world[a];
      if (j + 1 < {n})
        moment[r] += (place[j + 1][a] - place[j][a]) * force[b] - (place[j + 1][b] - place[j][b]) * force[a];
    }}
    for (r = 0; r < 3; ++r) force[r] += weight[r];
    tau[j] = {name}_offset[j];
    for (r = 0; r < 3; ++r) tau[j] += axis[j][r] * ({name}_prismatic[j] ? force[r] : moment[r]);
  }}
}}

static inline void {name}_friction(const double dq[{n}], double tau[{n}]) {{
  int j;
  for (j = 0; j < {n}; ++j) tau[j] = {name}_viscous[j] * dq[j] + {name}_coulomb[j] * {name}_sign(dq[j]);
{coupled}}}

#endif
"""

_COUPLED = """  for (int k = 0; k < {count}; ++k) {{
    const double *row = {name}_row[k];
    double speed = 0.0;
    for (j = 0; j < {n}; ++j) speed += row[j] * dq[j];
    for (j = 0; j < {n}; ++j)
      tau[j] += row[j] * ({name}_row_viscous[k] * (speed - row[j] * dq[j])
                          + {name}_row_coulomb[k] * {name}_sign(speed));
  }}
"""


def c_header(arm: IdentifiedArm) -> tuple[bytes, tuple[str, ...]]:
    """The C header, and what is not in it."""
    lost = arm.lost(BODIES | {TILT})
    name, n, frames = c_name(arm.robot.name), arm.robot.n, joint_frames(arm.robot)
    couplings = coupled = ""
    if arm.couplings:
        count = len(arm.couplings)
        rows = _braces([one.row for one in arm.couplings])
        viscous = _braces([one.viscous for one in arm.couplings])
        coulomb = _braces([one.coulomb for one in arm.couplings])
        couplings = (
            "/* drives that move with more than one joint */\n"
            f"static const double {name}_row[{count}][{n}] = {rows};\n"
            f"static const double {name}_row_viscous[{count}] = {viscous};\n"
            f"static const double {name}_row_coulomb[{count}] = {coulomb};"
        )
        coupled = _COUPLED.format(name=name, n=n, count=count)
    text = _C.format(
        heading="\n * ".join(wrap(arm.heading.replace("*/", ""), 100)),
        name=name,
        guard=name.upper(),
        n=n,
        lost="".join(f" * {line}\n" for one in lost for line in wrap(f"- {one}".replace("*/", ""), 100)),
        rotation=_braces([frame.rotation.ravel() for frame in frames]),
        origin=_braces([frame.position for frame in frames]),
        axis=_braces([frame.axis for frame in frames]),
        prismatic=_braces([float(joint.kind == "prismatic") for joint in arm.robot.joint]).replace(".0", ""),
        mass=_braces(arm.links[:, 0]),
        moment=_braces(arm.links[:, 1:4]),
        gravity=_braces(arm.robot.gravity),
        offset=_braces(arm.offset),
        damping=_braces(arm.damping),
        friction=_braces(arm.friction),
        couplings=couplings,
        coupled=coupled,
        width=repr(sign_width(arm)),
    )
    return text.encode(), (*lost, "Inertia and velocity products.")


_PYTHON = '''"""{heading}

`gravity(q)` is the torque that holds the arm still, offsets included; `friction(dq)` the torque against
friction; `feed_forward(q, dq)` their sum. Lists in, lists out, SI units; nothing but the standard library.

Not in it:
- Inertia and velocity products.
{lost}"""

from math import cos, sin, tanh

ROTATION = {rotation}
ORIGIN = {origin}
AXIS = {axis}
PRISMATIC = {prismatic}
MASS = {mass}
MOMENT = {moment}  # mass times centre, in the joint's frame
GRAVITY = {gravity}  # in the base
OFFSET = {offset}
VISCOUS = {damping}
COULOMB = {friction}
COUPLINGS = {couplings}  # drives that move with more than one joint: how, viscous, Coulomb
WIDTH = {width}  # rad/s or m/s; 0 is the exact sign


def gravity(q):
    frames, places, axes = [], [], []
    frame, place = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0, 0.0, 0.0]
    for j, angle in enumerate(q):
        place = _sum(place, _times(frame, ORIGIN[j]))
        fixed = _product(frame, ROTATION[j])
        axis = _times(fixed, AXIS[j])
        if PRISMATIC[j]:
            place, frame = _sum(place, [angle * z for z in axis]), fixed
        else:
            frame = _product(fixed, _turn(AXIS[j], angle))
        frames.append(frame)
        places.append(place)
        axes.append(axis)
    force, moment, tau = [0.0] * 3, [0.0] * 3, [0.0] * len(q)
    for j in reversed(range(len(q))):
        if j + 1 < len(q):
            arm = [there - here for there, here in zip(places[j + 1], places[j])]
            moment = _sum(moment, _cross(arm, force))
        moment = _sum(moment, _cross(GRAVITY, _times(frames[j], MOMENT[j])))
        force = _sum(force, [-MASS[j] * g for g in GRAVITY])
        carried = force if PRISMATIC[j] else moment
        tau[j] = OFFSET[j] + sum(z * value for z, value in zip(axes[j], carried))
    return tau


def friction(dq):
    tau = [viscous * v + coulomb * _sign(v) for viscous, coulomb, v in zip(VISCOUS, COULOMB, dq)]
    for row, viscous, coulomb in COUPLINGS:
        speed = sum(factor * v for factor, v in zip(row, dq))
        for j, (factor, v) in enumerate(zip(row, dq)):
            tau[j] += factor * (viscous * (speed - factor * v) + coulomb * _sign(speed))
    return tau


def feed_forward(q, dq):
    return _sum(gravity(q), friction(dq))


def _sign(speed):
    return tanh(speed / WIDTH) if WIDTH else float((speed > 0) - (speed < 0))


def _turn(z, angle):
    cross = [[0.0, -z[2], z[1]], [z[2], 0.0, -z[0]], [-z[1], z[0], 0.0]]
    square = _product(cross, cross)
    return [
        [(r == c) + sin(angle) * cross[r][c] + (1.0 - cos(angle)) * square[r][c] for c in range(3)]
        for r in range(3)
    ]


def _product(a, b):
    return [[sum(a[r][k] * b[k][c] for k in range(3)) for c in range(3)] for r in range(3)]


def _times(a, x):
    return [sum(a[r][k] * x[k] for k in range(3)) for r in range(3)]


def _sum(a, b):
    return [x + y for x, y in zip(a, b)]


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
'''


def python_feed_forward(arm: IdentifiedArm) -> tuple[bytes, tuple[str, ...]]:
    """The Python module, and what is not in it."""
    frames, lost = joint_frames(arm.robot), arm.lost(BODIES | {TILT})
    text = _PYTHON.format(
        heading=arm.heading,
        lost="".join(f"- {one}\n" for one in lost),
        rotation=[frame.rotation.tolist() for frame in frames],
        origin=[frame.position.tolist() for frame in frames],
        axis=[frame.axis.tolist() for frame in frames],
        prismatic=[joint.kind == "prismatic" for joint in arm.robot.joint],
        mass=arm.links[:, 0].tolist(),
        moment=arm.links[:, 1:4].tolist(),
        gravity=[float(g) for g in arm.robot.gravity],
        offset=arm.offset.tolist(),
        damping=arm.damping.tolist(),
        friction=arm.friction.tolist(),
        couplings=[(one.row.tolist(), one.viscous, one.coulomb) for one in arm.couplings],
        width=repr(sign_width(arm)),
    )
    return text.encode(), (*lost, "Inertia and velocity products.")


def sign_width(arm: IdentifiedArm) -> float:
    """Speed at which friction saturates, rad/s or m/s; 0 is the exact sign."""
    settings = arm.robot.identification
    return float(settings.friction_width) if settings.friction_sign == "tanh" else 0.0


def c_name(name: str) -> str:
    """A name as C and Python take it."""
    plain = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in name.lower())
    return f"arm_{plain}" if plain[:1].isdigit() else plain


def _braces(values: Iterable[Any]) -> str:
    """An initialiser that reads back the same."""
    shown = (_braces(value) if hasattr(value, "__len__") else repr(float(value)) for value in values)
    return "{" + ", ".join(shown) + "}"
