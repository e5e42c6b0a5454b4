"""``joint_limits.yaml``: the same keys serve MoveIt and the joint_limits of ros2_control."""

from __future__ import annotations

from robots import Robot


def joint_limits(robot: Robot, heading: str) -> str:
    """Limits of the description, SI, as YAML.

    Args:
        robot: the arm.
        heading: for the comment at the top.
    """
    lines = [f"# {heading}", "# Limits are those of the description; nothing of them was identified."]
    lines.append("joint_limits:")
    for joint in robot.joint:
        lines += [
            f"  {joint.name}:",
            "    has_position_limits: true",
            f"    min_position: {joint.position[0]!r}",
            f"    max_position: {joint.position[1]!r}",
        ]
        for what, value in (
            ("velocity", joint.velocity),
            ("acceleration", joint.acceleration),
            ("jerk", joint.jerk),
            ("effort", joint.torque),
        ):
            lines += [f"    has_{what}_limits: true", f"    max_{what}: {float(value)!r}"]
    return "\n".join(lines) + "\n"
