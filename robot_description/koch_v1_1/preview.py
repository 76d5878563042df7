"""Draws preview.png, the arm before a cube, and zero_pose.png. Usage: python -m robot_description.koch_v1_1.preview"""

from __future__ import annotations

from pathlib import Path

from robot_description.arm_preview import write

if __name__ == "__main__":
    write(Path(__file__).parent, thing="red_cube", height=0.04)
