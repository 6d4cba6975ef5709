"""The examples run, and write what they say."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

EXAMPLES = Path(__file__).parent.parent / "examples"


def run(folder, name, *words) -> str:
    command = [sys.executable, EXAMPLES / name, *map(str, words)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and done.stderr == "", done.stderr
    return done.stdout


def test_thumbnails(tmp_path):
    run(tmp_path, "thumbnail.py", "demo:furnace")
    assert (tmp_path / "furnace.png").stat().st_size > 1000


def test_a_dataset_has_masks_that_fill_their_boxes(tmp_path):
    run(tmp_path, "dataset.py", tmp_path / "set", 2, "96x64")
    coco = json.loads((tmp_path / "set/annotations.json").read_text())
    assert len(coco["images"]) == 2 and len(coco["annotations"]) > 6
    for annotation in coco["annotations"]:
        counts = annotation["segmentation"]["counts"]
        flat = np.repeat(np.arange(len(counts)) % 2, counts)
        mask = flat.reshape(96, 64).T
        x, y, width, height = annotation["bbox"]
        assert mask.sum() == annotation["area"] == mask[y : y + height, x : x + width].sum()
        assert mask[y].any() and mask[:, x].any()


def test_lights_differ(tmp_path):
    run(tmp_path, "lights.py", tmp_path, 3, "64x48")
    assert len({path.read_bytes() for path in tmp_path.glob("*.png")}) == 3


def test_errors_against_the_truth_are_small(tmp_path):
    lines = run(tmp_path, "truth.py", "demo:cornell", 8, "48x36").splitlines()
    assert [line.split()[0] for line in lines] == ["draft", "good"]
    assert all(0.7 < float(line.split()[-1]) < 1.3 for line in lines), lines


def test_flow_of_a_robot_leads_to_the_last_image(tmp_path):
    run(tmp_path, "robot.py", tmp_path, 3, "96x64")
    last, now = (np.load(tmp_path / f"{step:05}.npz") for step in (1, 2))
    rows, columns = np.nonzero(now["depth"])
    flow = now["flow_to_last"][rows, columns]

    def on_surface(flow) -> float:
        x, y = np.round(np.stack([columns, rows], 1) + flow).astype(int).clip(0, (95, 63)).T
        return (last["depth"][y, x] > 0).mean()

    # Links are 5 pixels wide: whole pixels miss their edges.
    assert on_surface(flow) > 0.85 > 0.75 > on_surface(-flow) and np.abs(flow).max() > 2
