"""`pictura map` of recorded scenes, from outside. Usage: scene_command_test.py PICTURA SCENE_FIXTURE."""

import json
import pathlib
import subprocess
import sys
import tempfile

PICTURA, FIXTURE = sys.argv[1:3]


def run(*words, status=0):
    done = subprocess.run([PICTURA, "map", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == status, (words, done)
    return done


def facts(scene):
    return json.loads(run(scene, "--json").stdout)


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    subprocess.run([FIXTURE, "write", name], check=True)
    (folder / "womd_proto.json").unlink()
    for file, form, lights in [
        ("womd.tfrecord", "womd", 3),
        ("gpudrive.json", "gpudrive", 3),
        ("pufferdrive_v1.bin", "pufferdrive v1", 0),
        ("pufferdrive_v2.bin", "pufferdrive v2", 0),
        ("pufferdrive_v3c.bin", "pufferdrive v3c", 4),
    ]:
        found = facts(folder / file)
        expected = {
            "format": form, "steps": 91, "tracks": 12, "vehicles": 8, "moving_vehicles": 4, "pedestrians": 3, "cyclists": 1,
            "tracks_with_gaps": 1, "lanes": 16, "crosswalks": 1, "signs": 1, "recorded_lights": lights, "steps_touching_edge": 0,
            "steps_off_road": 0, "roads": 0, "traffic_lights": 0,
        }
        assert {key: found[key] for key in expected} == expected, (file, found)
        assert found["moving_vehicle_steps"] > 300 and found["load_ms"] > 0
    assert facts(f"{folder}#4")["format"] == "womd", "files in order of their names"
    assert facts(f"{folder}#fixture00000001")["scenario_id"] == "fixture00000001"

    run(folder / "womd.tfrecord", "--png", folder / "scene.png", "--size", 800)
    assert (folder / "scene.png").read_bytes().startswith(b"\x89PNG")
    run(folder / "womd.tfrecord", "--svg", folder / "scene.svg")
    svg = (folder / "scene.svg").read_text()
    run(folder / "womd.tfrecord", "--svg", folder / "part.svg", "--at", -7887, 6796, "--radius", 10)
    assert len(svg) > len((folder / "part.svg").read_text()) > 1000
    elements = json.loads(run(folder / "gpudrive.json", "--json", "--full").stdout)["elements"]
    assert len(elements["lanes"]) == 16
    assert "format" in run(folder / "gpudrive.json").stdout

    refused = run(f"{folder}#5", status=2).stderr
    assert refused.startswith("error: ") and "expected #0 to #4 or the id of one of its scenes, got #5" in refused, refused
    assert "has no OpenDRIVE" in run(folder / "gpudrive.json", "--xodr", folder / "x.xodr", status=2).stderr
    assert "no such file or folder" in run(folder / "none.tfrecord", status=1).stderr
    damaged = bytearray((folder / "womd.tfrecord").read_bytes())
    damaged[1000] ^= 1
    (folder / "damaged.tfrecord").write_bytes(damaged)
    refused = run(folder / "damaged.tfrecord", status=1).stderr
    assert "damaged.tfrecord: record 0: expected the checksum" in refused, refused
print("all good")
