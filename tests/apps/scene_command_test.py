"""`pictura map`, `simulate`, `render` and `evaluate` of recorded scenes, from outside. Usage: scene_command_test.py PICTURA SCENE_FIXTURE."""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

import command_case

FIXTURE = sys.argv[1]


def run(*words, status=0, command="map"):
    done = command_case.run(command, *words)
    assert done.returncode == status, (words, done)
    return done


def simulate(*words):
    return json.loads(run(*words, "--json", command="simulate").stdout)


def refusal(*words, command="simulate"):
    return run(*words, status=2, command=command).stderr


def varint(data, at):
    """Returns the protobuf integer at data[at:], and the index after it."""
    value = shift = 0
    while True:
        byte = data[at]
        value, shift, at = value | (byte & 127) << shift, shift + 7, at + 1
        if byte < 128:
            return value, at


def encoded(value):
    """Returns a protobuf integer."""
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def without_last_rollout(data):
    """Returns rollouts of one scene, which are the last field of the file and of the scene, without the last rollout."""
    _, after = varint(data, varint(data, 0)[1])  # the type of the submission
    begin = varint(data, after)[1]
    scene = data[varint(data, begin)[1] :]
    at = 0
    while at < len(scene):
        last = at
        length, content = varint(scene, varint(scene, at)[1])
        at = content + length
    return data[:begin] + encoded(last) + scene[:last]


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

    # Replays as recorded: all formats, no agent-step, the same bits with each number of threads.
    for file in ("womd.tfrecord", "gpudrive.json", "pufferdrive_v1.bin", "pufferdrive_v2.bin", "pufferdrive_v3c.bin"):
        replayed = simulate(folder / file)
        expected = {
            "asked": 12, "spawned": 12, "steps": 90, "agent_steps": 0, "collisions": 0, "off_road": 0, "displacement_steps": 0,
        }
        assert {key: replayed[key] for key in expected} == expected, (file, replayed)
        assert replayed == simulate(folder / file, "--policy", "log", "--threads", 1) | {
            key: replayed[key] for key in replayed if key.endswith("_per_s")
        }
    scene = folder / "womd.tfrecord"
    assert simulate(scene, "--start", 30)["steps"] == 60
    assert simulate(scene, "--steps", 20)["steps"] == 20
    driven = simulate(scene, "--policy", "idle", "--control", "self", "--steps", 10)
    assert driven["agent_steps"] == 10 and driven["displacement_max_m"] < 0.1, driven
    assert simulate(scene, "--policy", "inverse", "--control", "1000,1014", "--steps", 10)["agent_steps"] == 20
    assert simulate(scene, "--recorded-lights")["state_hash"] != simulate(scene)["state_hash"]
    # Longer than the recording: no road user reappears.
    assert simulate(scene, "--policy", "random", "--control", "all", "--steps", 120)["episodes"] == 0

    def render(*words):
        out = folder / "images"
        shutil.rmtree(out, ignore_errors=True)
        drawn = json.loads(run(scene, *words, "--backend", "cpu", "--out", out, "--json", command="render").stdout)
        return drawn, {path.name for path in out.glob("[!.]*")}

    drawn, files = render("--figure", "--size", "32x18")
    assert drawn["images"] == 4 and drawn["cameras"] == 4
    assert files == {f"track1000_{camera}.png" for camera in ("front", "front_left", "front_right", "back")} | {
        "track1000.png", "figure.png", "contact_sheet.png"}, files
    lit, _ = render("--recorded-lights", "--size", "32x18")
    assert lit["image_hash"] != drawn["image_hash"]
    later, _ = render("--start", 60, "--size", "32x18")
    assert later["image_hash"] != drawn["image_hash"]
    several, files = render("--start", 10, "--tracks", "self,1007", "--size", "32x18")
    assert several["images"] == 8 and {name.split("_")[0] for name in files} == {"track1000", "track1007", "contact"}
    out = ("--out", folder / "images")
    assert "--tracks: expected self (or sdc), vehicles" in refusal(scene, "--tracks", "cars", *out, command="render")
    assert "--views: has no effect on a recorded scene" in refusal(scene, "--views", 2, *out, command="render")
    assert "--start: has no effect on procedural:1" in refusal("procedural:1", "--start", 2, *out, command="render")
    assert "in [0, 91), got 91" in refusal(scene, "--start", 91, *out, command="render")

    run(scene, "--out", folder / "scene.html", "--mcap", folder / "scene.mcap", command="replay")
    assert (folder / "scene.html").stat().st_size > 10_000 and (folder / "scene.mcap").stat().st_size > 10_000
    if shutil.which("ffmpeg"):
        simulate(scene, "--steps", 4, "--video", folder / "scene.mp4")
        assert (folder / "scene.mp4").stat().st_size > 2000

    assert "--agents: has no effect on a recorded scene" in refusal(scene, "--agents", 4)
    assert "--light-cycles: has no effect on a recorded scene" in refusal(scene, "--light-cycles", "independent")
    assert "--light-heads: has no effect on a recorded scene" in refusal(scene, "--light-heads", "visible")
    assert "--control: has no effect with the policy log" in refusal(scene, "--control", "self")
    assert "--start: has no effect on procedural:1, which is no recorded scene" in refusal("procedural:1", "--start", 4)
    assert "--control: expected self (or sdc), vehicles" in refusal(scene, "--policy", "idle", "--control", "cars")
    assert "selects none of its 12" in refusal(scene, "--policy", "idle", "--control", "3")
    assert "in [0, 91), got 91" in refusal(scene, "--start", 91)
    assert "--follow: expected 0 to 11, got 12" in refusal(scene, "--replay", folder / "x.html", "--follow", 12)
    assert "expected a recorded scene, got map" in refusal("procedural:1", "--agents", 2, "--policy", "log")
    assert "expected a map of roads" in refusal(scene, "--policy", "lane")

    refused = run(f"{folder}#5", status=2).stderr
    assert refused.startswith("error: ") and "expected #0 to #4 or the id of one of its scenes, got #5" in refused, refused
    assert "has no OpenDRIVE" in run(folder / "gpudrive.json", "--xodr", folder / "x.xodr", status=2).stderr
    assert "no such file or folder" in run(folder / "none.tfrecord", status=1).stderr
    damaged = bytearray((folder / "womd.tfrecord").read_bytes())
    damaged[1000] ^= 1
    (folder / "damaged.tfrecord").write_bytes(damaged)
    refused = run(folder / "damaged.tfrecord", status=1).stderr
    assert "damaged.tfrecord: record 0: expected the checksum" in refused, refused

    # Evaluations: one damaged scene of six is skipped.
    words = ("--policy", "idm", "--protocol", "womd", "--scenes", folder, "--threads", 1)
    if command_case.has_torch():
        done = run(*words, "--csv", folder / "agents.csv", "--json", command="evaluate")
        report = json.loads(done.stdout)
        assert "warning: left out: " in done.stderr and "damaged.tfrecord: record 0" in done.stderr, done.stderr
        assert (report["scenes"], report["scored"], report["without_drivers"]) == (6, 5, 0), report
        assert len(report["faults"]) == 1 and report["rules"]["overlapping"] == "replay"
        assert report["repaired_headings"] == 0, report
        turned = json.loads((folder / "gpudrive.json").read_text())
        for road_user in turned["objects"][:2]:
            road_user["heading"][road_user["valid"].index(True)] += 1
        (folder / "turned.json").write_text(json.dumps(turned))
        repairs = (
            "--policy", "idm", "--protocol", "womd", "--scenes", folder / "turned.json", "--threads", 1, "--density", "100",
            "--steps", 1, "--rule", "max_first_turn_deg=10",
        )  # fmt: skip
        assert json.loads(run(*repairs, "--json", command="evaluate").stdout)["repaired_headings"] == 2
        assert "2 first headings repaired" in run(*repairs, command="evaluate").stdout
        (folder / "turned.json").unlink()
        assert [row["density"] for row in report["rows"]] == [1, 0.75, 0.5]
        assert report["rows"][0]["vehicle_episodes"] > report["rows"][2]["vehicle_episodes"] > 0
        rows = (folder / "agents.csv").read_text().splitlines()
        assert rows[0].startswith("scenario_id,density,rollout,track_id,type,"), rows[0]
        assert rows[1].startswith('"fixture00000001",1,0,'), rows[1]
        assert len(rows) == 1 + sum(row["vehicle_episodes"] for row in report["rows"])
        table = run(*words, "--density", "100,50", "--rule", "late=drive", "--steps", 20, command="evaluate").stdout
        assert "late=drive" in table and "paper: perspective" in table and "75 %" not in table, table
        self_alone = json.loads(
            run("--policy", "idm", "--protocol", "waymax", "--scenes", scene, "--json", command="evaluate").stdout
        )
        assert self_alone["steps"] == 80 and self_alone["start_step"] == 10
        assert self_alone["rows"][0]["vehicle_episodes"] == 1, self_alone

        # Merged parts equal the whole. They are not in the scenes' folder, since scenes may be JSON too.
        parts = folder / "parts"
        parts.mkdir()

        def part(name, *more):
            run(*words, "--steps", 40, "--out", parts / name, *more, command="evaluate")
            return parts / name

        whole, first, second = part("whole.json"), part("first.json", "--scenarios", "0:2"), part("second.json", "--scenarios", "2:6")
        merged = run("--merge", second, first, "--out", parts / "merged.json", "--json", command="evaluate")
        assert (parts / "merged.json").read_bytes() == whole.read_bytes()
        report = json.loads(merged.stdout)
        assert (report["scenes"], report["scored"], len(report["faults"]), report["seconds"]) == (6, 5, 1, None), report
        assert "0 s:" not in run("--merge", first, second, command="evaluate").stdout
        refused = run("--merge", second, second, command="evaluate", status=1).stderr
        assert "second.json: begins with scene 2: expected 6" in refused, refused

        # Rollouts: a road user has five fields, of which four hold 80 floats.
        sim_agents = ("--policy", "random", "--protocol", "simagents", "--scenes", scene, "--device", "cpu")
        rollouts = folder / "rollouts.binproto"
        report = json.loads(run(*sim_agents, "--rollouts", rollouts, "--json", command="evaluate").stdout)
        assert report["rules"]["rollouts"] == "32" and report["rows"][0]["vehicle_episodes"] == 32 * 8, report
        assert 32 * 12 * 4 * 320 < rollouts.stat().st_size < 32 * 12 * (4 * 320 + 30), rollouts.stat().st_size
        # Realism of the rollouts, computed during the evaluation and from the file.
        report = json.loads(run(*sim_agents, "--realism", "2025", "--json", command="evaluate").stdout)["realism"]
        score = json.loads(run(rollouts, "--scenes", scene, "--json", command="score").stdout)
        assert score == report and 0 < score["realism"] < 1 and score["scored"] == 1 and len(score["likelihoods"]) == 10, score
        fewer = folder / "fewer.binproto"
        fewer.write_bytes(without_last_rollout(rollouts.read_bytes()))
        warning = run(fewer, "--scenes", scene, command="score").stderr
        assert "not comparable: scenario 'fixture00000001': expected 32 rollouts, got 31" in warning, warning
        assert run(rollouts, "--scenes", scene, command="score").stderr.count("warning") == 0
        table = run(rollouts, "--scenes", folder / "pufferdrive_v1.bin", command="score", status=1).stderr
        assert "rollouts.binproto: expected rollouts of a scene of" in table and "1 are not in it" in table, table
        table = run(*sim_agents, "--realism", "2024", command="evaluate").stdout
        assert "realism 2024: 1 scenes, 2 road users scored" in table and "distance_to_road_edge        0.10" in table, table

        rate = json.loads(
            run("scenes", "--policy", "idm", "--protocol", "waymax", "--scenes", scene, "--copies", 3, "--repeats", 2, "--device",
                "cpu", "--json", command="bench").stdout
        )
        assert rate["results"][0]["unit"] == "scenes_per_min" and rate["results"][0]["repeats"] == 2, rate
        assert "3 copies of" in rate["workload"] and ", 3 scored; protocol waymax, 80 steps" in rate["workload"], rate
        assert "expected --scenes" in refusal("scenes", "--policy", "idm", command="bench")
        for expected, bad in [
            ("--rollouts: has no effect without --protocol", ("--policy", "idle", "--rollouts", folder / "x")),
            ("expected 32 rollouts of 80 steps from step 10", (*words, "--rollouts", folder / "x")),
            ("--realism: has no effect without --protocol", ("--policy", "idle", "--realism", "2025")),
            ("expected 32 rollouts of 80 steps from step 10", (*words, "--realism", "2025")),
            ("got rollouts=4, 80 steps", (*sim_agents, "--rule", "rollouts=4", "--rollouts", folder / "x")),
            ("--protocol: expected also --scenes", ("--policy", "idm", "--protocol", "womd")),
            ("--csv: has no effect without --protocol", ("--policy", "idle", "--csv", folder / "x.csv")),
            ("--map: has no effect with --protocol", (*words, "--map", "procedural:1")),
            ("expected shares in %, above 0 and at most 100, got 'dense'", (*words, "--density", "dense")),
            ("rules: expected overlapping, others", (*words, "--rule", "nobody=drive")),
            ("--control", (*words, "--control", "cars")),
        ]:
            refused = run(*bad, command="evaluate", status=2).stderr
            assert expected in refused or (expected == "--control" and "got 'cars'" in refused), refused
print("all good")
