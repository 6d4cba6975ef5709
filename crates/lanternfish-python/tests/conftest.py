"""Scenes that tests share."""

import sys
from pathlib import Path

import numpy as np
import pytest

import lanternfish as lf

sys.path.append(str(Path(__file__).parent.parent / "examples"))
from dataset import ball  # noqa: E402

SIZE = (96, 64)


def sphere() -> lf.Mesh:
    """A sphere of 1 m with exact normals, which it is within 2e-5 m."""
    return ball(1.0, 256)


def quad(material: lf.Material = lf.Material()) -> lf.Mesh:
    """A square of 2 m in the plane z = 0 that faces +z."""
    return lf.Mesh([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)], material=material,
                   uv=[(0, 1), (1, 1), (1, 0), (0, 0)])


def at(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def rays(camera: lf.Camera, size=SIZE) -> tuple:
    """Eye, and the direction of each pixel's centre, of length 1 along the view axis."""
    (fx, _, cx), (_, fy, cy), _ = camera.intrinsics(size)
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    local = np.stack([(x - cx) / fx, (cy - y) / fy, -np.ones_like(x)], axis=-1)
    return camera.pose[:3, 3], local @ camera.pose[:3, :3].T


@pytest.fixture
def ball_and_plane() -> lf.Scene:
    scene = lf.Scene()
    scene.add(sphere(), pose=at(0, 1, 0), name="ball", semantic=7)
    floor = np.array([(1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)], float) @ np.diag([20, 20, 20, 1.0])
    scene.add(quad(lf.Material((0.2, 0.4, 0.6), name="paint")), pose=floor, name="floor", semantic=1)
    scene.add(lf.DirectionalLight((-1, -2, -1), 3))
    return scene
