"""Recordings, live pages in the browser, and rerun."""

import http.client
import json
import subprocess
import sys
import threading
import urllib.parse
import webbrowser

import numpy as np
import pytest
from conftest import actions_of
from replay_pages import Events, header_of

import pictura


def test_a_recording_holds_the_simulators_states(make, tmp_path):
    simulator = make(6, 2, seed=4)
    recorder = pictura.Recorder(simulator, world=1, follow=2, rig=pictura.Rig.paper(16, 9))
    reward, driven_m = 0.0, 0.0
    for step in range(30):
        recorder.decide(np.arange(12), 0.5)
        result = simulator.step(actions_of(step, simulator.num_slots))
        reward += float(result.reward.numpy()[6:].sum())
        driven_m += float(result.distance_m.numpy()[6:].sum())
    assert recorder.num_steps == 30
    metrics = recorder.metrics
    assert metrics["reward"] == pytest.approx(reward, rel=1e-5)
    assert metrics["km_driven"] * 1000 == pytest.approx(driven_m, rel=1e-5) and driven_m > 10
    page, mcap = tmp_path / "drive.html", tmp_path / "drive.mcap"
    recorder.write(str(page), policy="by hand")
    recorder.write(str(mcap))
    header = header_of(page)
    assert header["policy"] == "by hand" and header["map"] == "procedural:3" and header["command"].startswith("python")
    assert mcap.read_bytes().startswith(b"\x89MCAP")
    # The replay has been written: later steps are not in it.
    simulator.step(actions_of(0, simulator.num_slots))
    assert recorder.num_steps == 30
    assert pictura.write_gallery(str(tmp_path)) == 1 and (tmp_path / "index.html").exists()


def test_a_recording_changes_nothing_and_includes_steps_of_every_kind(make):
    plain, watched = make(8, seed=9), make(8, seed=9)
    recorder = pictura.Recorder(watched)
    for simulator in (plain, watched):
        lane = pictura.Controller("lane", simulator)
        simulator.run(lane, 5)
        simulator.step_commands(lane.act(simulator))
        for step in range(5):
            simulator.step(actions_of(step, 8))
        simulator.reset(seed=3)
        simulator.step(actions_of(6, 8))
    assert plain.state_hash() == watched.state_hash()
    assert recorder.num_steps == 13  # a reset adds a frame as well
    del recorder
    plain.step(actions_of(7, 8))
    watched.step(actions_of(7, 8))
    assert plain.state_hash() == watched.state_hash()


def test_a_reset_begins_a_recorded_episode(make, tmp_path):
    simulator = make(4)
    recorder = pictura.Recorder(simulator)
    for seed in (1, 2):
        simulator.step(actions_of(seed, 4))
        simulator.reset(seed=seed)
    recorder.write(str(tmp_path / "resets.html"))
    header = header_of(tmp_path / "resets.html")
    assert header["seed"] == "2", "of the last reset"
    assert header["frames"] == 5, "a first one, two steps and two resets"
    assert header["metrics"]["spawned"] > 8, "three episodes of up to four agents"


def test_resets_of_other_worlds_are_not_recorded(make):
    simulator = make(3, 2)
    recorder = pictura.Recorder(simulator, world=1)
    scenes = pictura.SceneRecorder(simulator, world=1)
    simulator.reset(np.array([1, 0], np.uint8))  # both worlds are at the start of an episode
    assert recorder.num_steps == scenes.num_steps == 0
    simulator.step(actions_of(0, 6))
    simulator.reset(np.array([1, 0], np.uint8))
    assert recorder.num_steps == scenes.num_steps == 1
    simulator.step(actions_of(1, 6))
    assert recorder.num_steps == scenes.num_steps == 2
    simulator.reset(np.array([0, 1], np.uint8))
    assert (recorder.num_steps, scenes.num_steps) == (3, 2), "a scene is of one episode"


def test_errors_name_unsupported_recordings(make, tmp_path):
    simulator = make(3)
    with pytest.raises(pictura.UsageError, match="world of 0 to 0, got 2"):
        pictura.Recorder(simulator, world=2)
    with pytest.raises(pictura.UsageError, match="agent of 0 to 2 to follow, got 3"):
        pictura.Recorder(simulator, follow=3)
    recorder = pictura.Recorder(simulator)
    with pytest.raises(pictura.UsageError, match="follows no agent"):
        recorder.decide(np.zeros(12))
    with pytest.raises(pictura.UsageError, match=r"\*.html or \*.mcap, got 'a.gif'"):
        recorder.write("a.gif")
    with pytest.raises(pictura.Error, match="nowhere"):
        recorder.write(str(tmp_path / "nowhere/a.html"))
    with pytest.raises(pictura.Error, match="zero byte"):
        recorder.write(str(tmp_path / "a\0.html"))
    followed = pictura.Recorder(simulator, follow=0)
    with pytest.raises(pictura.Error, match="logits: expected \\[12\\], got 11"):
        followed.decide(np.zeros(11))
    with pytest.raises(pictura.Error):
        simulator.step(np.full(3, 12, np.int32))
    assert recorder.num_steps == 0


def test_a_live_view_shows_steps_and_accepts_driving(make):
    simulator = make(5, seed=2)
    recorder = pictura.Recorder(simulator)  # the view replaces its commands
    view = pictura.LiveView(simulator, follow=1, wait_for_page=False)
    events = Events(view.address)
    before = simulator.state["x_m"].numpy().copy()
    for step in range(3):
        simulator.step(actions_of(step, 5))
    begin, frame = events.next("begin"), events.next("frame")
    assert begin["header"]["agents"] == 5
    assert frame["step"] >= 1 and view.num_pages == 1
    parts = urllib.parse.urlsplit(view.address)
    connection = http.client.HTTPConnection("127.0.0.1", parts.port, timeout=60)
    body = json.dumps({"drive": 0, "keys": ["forward"], "pace": 64})
    connection.request("POST", parts.path + "control", body, {"Content-Type": "application/json"})
    assert connection.getresponse().status in (200, 204)
    idle = np.full(5, pictura.IDLE_ACTION, np.int32)
    speed = simulator.state["speed_mps"].numpy()
    at_first = float(speed[0])
    for _ in range(8):
        simulator.step(idle)
    assert simulator.state["status"].numpy()[0] != 0 or float(speed[0]) > at_first, "the keys accelerate"
    assert not np.array_equal(before, simulator.state["x_m"].numpy())
    recorded = recorder.metrics
    assert recorded["km_driven"] == pytest.approx(simulator.totals()["distance_m"] / 1000, rel=1e-5)
    view.close()
    assert events.next("end")["step"] >= 11
    events.close()
    with pytest.raises(pictura.Error, match="closed"):
        view.address
    simulator.step(idle)


def test_a_step_waits_for_a_page_by_default(make):
    simulator = make(2)
    view = pictura.LiveView(simulator)
    stepped = threading.Event()

    def step():
        simulator.step(np.full(2, pictura.IDLE_ACTION, np.int32))
        stepped.set()

    thread = threading.Thread(target=step)
    thread.start()
    assert not stepped.wait(0.4)
    events = Events(view.address)
    assert stepped.wait(30)
    thread.join()
    events.close()


def test_human_rendering_opens_a_page(monkeypatch, capfd):
    gymnasium = pytest.importorskip("gymnasium")
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    env = gymnasium.make("pictura/Drive-v0", num_agents=4, render_mode="human")
    env.reset(seed=1)
    env.step(7)
    assert env.render() is None and len(opened) == 1 and opened[0] in capfd.readouterr().err
    events = Events(opened[0])
    env.reset(seed=2)
    env.step(7)
    assert events.next("begin")["header"]
    events.close()
    env.close()
    assert len(opened) == 1
    with pytest.raises(pictura.UsageError, match="'ansi'"):
        gymnasium.make("pictura/Drive-v0", render_mode="ansi", disable_env_checker=True)


def test_worlds_are_logged_to_rerun(town, make, tmp_path):
    rerun = pytest.importorskip("rerun")
    import pictura.rerun

    recording = rerun.RecordingStream("pictura")
    path = tmp_path / "world.rrd"
    recording.save(path)
    pictura.rerun.log_map(town, recording=recording)
    simulator = make(6)
    rig = pictura.Rig.paper(16, 9)
    renderer = pictura.Renderer("cpu", rig)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    for step in range(3):
        simulator.step(actions_of(step, 6))
        pictura.rerun.log_world(simulator, step * simulator.dt_s, recording=recording)
        pictura.rerun.log_images(renderer.render(simulator.scene, simulator.views), 0, rig, recording=recording)
    recording.disconnect()
    data = path.read_bytes()
    for name in (b"world/map/markings", b"world/agents", b"world/velocities", b"cameras/" + rig.cameras[0].name.encode()):
        assert name in data, name
    with pytest.raises(pictura.UsageError, match="world of 0 to 0 on cpu, got 1"):
        pictura.rerun.log_world(simulator, 0.0, world=1)


def test_rerun_shows_bodies_at_their_poses(make, monkeypatch):
    rerun = pytest.importorskip("rerun")
    import pictura.rerun

    simulator = make(6, 2)
    logged = {}
    monkeypatch.setattr(rerun, "log", lambda entity, what, **_: logged.update({entity: what}))
    monkeypatch.setattr(rerun, "set_time", lambda *_, **__: None)
    monkeypatch.setattr(rerun, "Boxes3D", lambda **of: of)
    pictura.rerun.log_world(simulator, 0.0, world=1)
    state = {name: array.numpy()[6:] for name, array in simulator.state.items()}
    there = state["status"] != 3
    half = 0.5 * state["length_m"][there]
    centers, x_m = logged["world/agents"]["centers"], state["x_m"][there]
    ahead = (centers[:, 0] - x_m) * np.cos(state["heading_rad"][there]) + (centers[:, 1] - state["y_m"][there]) * np.sin(state["heading_rad"][there])
    on_wheels = state["agent_class"][there] != 2
    assert on_wheels.sum() > 2 and (ahead[on_wheels] > 0.5 * half[on_wheels]).all() and (ahead < half).all(), "a state is the rear axle's"


def test_errors_name_a_missing_rerun_package():
    code = "import sys; sys.modules['rerun'] = None; import pictura.rerun"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert result.returncode != 0 and "pip install rerun-sdk" in result.stderr
