"""The chain of a robot description (URDF), read and multiplied out by code that shares nothing with the package."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np


def turn(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotations about an axis by Rodrigues' formula, one for each angle."""
    x, y, z = axis / np.linalg.norm(axis)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle)[..., None, None]
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * (across @ across)


def numbers(element: ElementTree.Element | None, key: str, absent: str) -> np.ndarray:
    return np.array((absent if element is None else element.get(key, absent)).split(), dtype=float)


class Urdf:
    """The joints from a link (the root of the tree, where none is named) to another: fixed transforms and axes."""

    def __init__(self, text: str, tip: str = "tool0", base: str | None = None):
        root = ElementTree.fromstring(text)
        to = {joint.find("child").get("link"): joint for joint in root.findall("joint")}
        self.joints, link = [], tip
        while link in to and link != base:
            self.joints.insert(0, to[link])
            link = to[link].find("parent").get("link")
        assert base in (None, link), f"{link} is the root above {tip}, not {base}"

    @property
    def names(self) -> list[str]:
        """Of the joints that turn."""
        return [joint.get("name") for joint in self.joints if joint.get("type") != "fixed"]

    def forward(self, q_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (mm) and rotations of the tip for rows of angles."""
        place, rotation = np.zeros((len(q_rad), 3)), np.broadcast_to(np.eye(3), (len(q_rad), 3, 3))
        angles = iter(q_rad.T)
        for joint in self.joints:
            origin = joint.find("origin")
            place = place + 1000 * rotation @ numbers(origin, "xyz", "0 0 0")
            for axis, angle in zip(np.eye(3)[::-1], numbers(origin, "rpy", "0 0 0")[::-1], strict=True):
                rotation = rotation @ turn(axis, angle)
            if joint.get("type") != "fixed":
                rotation = rotation @ turn(numbers(joint.find("axis"), "xyz", "1 0 0"), next(angles))
        assert next(angles, None) is None
        return place, rotation
