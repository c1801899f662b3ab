"""Training, evaluation and saved policies in Python: the same numbers as pictura.torch and the command. Skipped if the
package was built without torch."""

import csv
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import pictura
from pictura import _load_training, realism

if not _load_training.usable_torch():
    pytest.skip("built without the torch that is installed", allow_module_level=True)
torch = pytest.importorskip("torch")
from pictura.torch import load_policy  # noqa: E402

MODELS = sorted((pathlib.Path(__file__).parents[2] / "models").glob("*.safetensors"))
SMOKE = str(pathlib.Path(__file__).parents[2] / "configs" / "smoke.toml")
# Initial values are too small for meaningful logits; a few updates at a high rate enlarge them.
TRAIN = ["train.updates=3", "train.learning_rate=0.01", "train.weight_average=2", "run.device=cpu", "run.num_threads=2"]


@pytest.fixture(scope="module", params=["perspective", "vector"])
def trained(request, tmp_path_factory):
    """Returns (modality, folder of the run, progress, report)."""
    out = tmp_path_factory.mktemp(request.param)
    progress = []
    report = pictura.train(
        SMOKE, str(out / "run"), overrides=[*TRAIN, f"policy.modality={request.param}"], on_progress=progress.append
    )
    return request.param, out / "run", progress, report


@pytest.fixture
def session(trained):
    return pictura.PolicySession(str(trained[1] / "checkpoint.ckpt"), device="cpu", num_threads=1)


def world_of(session, town, agents: int = 12, **options) -> pictura.Simulator:
    return pictura.Simulator([town], [(0, agents)], **(session.training_world() | {"num_threads": 1, "seed": 5} | options))


def renderer_of(session, simulator):
    renderer = session.make_renderer()
    if renderer is not None:
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
    return renderer


def images_of(renderer, simulator) -> dict:
    return {} if renderer is None else {"rgb": renderer.render(simulator.scene, simulator.views).rgb.torch()}


def test_training_reports_and_writes(trained):
    _, folder, progress, report = trained
    assert [update["update"] for update in progress] == [1, 2, 3] and progress[0]["updates"] == 3
    assert report["updates"] == 3 and report["agent_steps"] == progress[-1]["agent_steps"] > 0
    assert "loss/policy" in progress[0]["scalars"] or len(progress[0]["scalars"]) > 5
    assert report["checkpoint"] == str(folder / "checkpoint.ckpt")
    assert {"checkpoint.ckpt", "policy.safetensors", "progress.csv"} <= {path.name for path in folder.iterdir()}
    first = load_policy(folder / "untrained.ckpt").state_dict()
    assert any(not torch.equal(first[name], value) for name, value in load_policy(folder / "checkpoint.ckpt").state_dict().items())


def test_torch_module_matches_the_library_for_a_trained_policy(trained, session, town):
    modality, folder, _, _ = trained
    assert session.reads_images == (modality == "perspective") and session.device == "cpu"
    simulator = world_of(session, town)
    renderer = renderer_of(session, simulator)
    policy = load_policy(folder / "policy.safetensors")
    for _ in range(5):
        simulator.step(np.full(12, 10, np.int32))
        seen = {"scene": simulator.scene, "views": simulator.views, "renderer": renderer} if renderer else {}
        logits, values = session.evaluate(simulator.observations, **seen)
        observation = {name: array.torch() for name, array in simulator.observations.items()} | images_of(renderer, simulator)
        with torch.no_grad():
            expected, expected_values = policy(observation)
        assert expected.std() > 0.1
        torch.testing.assert_close(logits.torch(), expected, rtol=0, atol=1e-5)
        torch.testing.assert_close(values.torch(), expected_values, rtol=0, atol=1e-5)


def test_environments_are_made_for_a_policy(trained):
    modality, folder, _, _ = trained
    path = folder / "policy.safetensors"
    policy = load_policy(path)
    assert policy.metadata["path"] == str(path) and policy.metadata["config"]["policy"]["modality"] == modality
    assert len(policy.metadata["rig"]) == 4 and policy.metadata["update"] > 0
    for of in (policy, path, str(folder / "checkpoint.ckpt")):
        envs = pictura.make_vec_for(of, "procedural:3", 4, num_worlds=2, num_threads=1)
        seen, _ = envs.reset(seed=1)
        assert ("rgb" in seen) == (modality == "perspective") and ("lanes" in seen) == (modality == "vector")
        actions = policy.act(seen)
        assert torch.equal(actions, policy.act({name: torch.from_numpy(array) for name, array in seen.items()}))
        envs.step(actions.numpy())
    # The same world as the session's, and another world than the default.
    world = pictura.PolicySession(str(path), device="cpu").training_world() | {"num_threads": 1, "seed": 0, "stagger_episodes": False}
    ours, its = pictura.Simulator([pictura.Map.load("procedural:3")], [(0, 4, 0), (0, 4, 1)], **world), envs.batch.simulator
    ours.reset(None, 5)
    its.reset(None, 5)
    assert ours.state_hash() == its.state_hash() != pictura.make_vec("procedural:3", 4, num_worlds=2).batch.simulator.state_hash()
    other = {"images": "vector", "vector": "images"}["images" if modality == "perspective" else "vector"]
    shown, _ = pictura.make_vec("procedural:3", 4, observation=other).reset(seed=1)
    missing = "rgb" if modality == "perspective" else "set_counts"
    with pytest.raises(pictura.UsageError, match=f"a {modality} policy reads .*: expected '{missing}', got .*make_vec_for"):
        policy.act(shown)
    with pytest.raises(pictura.UsageError, match="expected a dict with ego, .*, got ndarray"):
        policy.act(shown["ego"])
    if modality == "perspective":
        width, height = policy.metadata["rig"][0]["size_px"]
        rig = pictura.Rig.paper(2 * width, 2 * height)
        shown, _ = pictura.make_vec("procedural:3", 4, observation="images", rig=rig).reset(seed=1)
        with pytest.raises(pictura.UsageError, match=f"expected images of {width}x{height}, .*, got {2 * width}x{2 * height}"):
            policy.act(shown)
    del policy.metadata["path"]
    with pytest.raises(pictura.UsageError, match="policy: expected a file name"):
        pictura.make_vec_for(policy)


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_torch_module_matches_the_library_for_released_policies(path, town):
    session = pictura.PolicySession(str(path), device="cpu", num_threads=1)
    simulator = world_of(session, town)
    renderer = renderer_of(session, simulator)
    simulator.run(session.make_controller(simulator, renderer), 10)
    seen = {"scene": simulator.scene, "views": simulator.views, "renderer": renderer} if renderer else {}
    logits, values = session.evaluate(simulator.observations, **seen)
    with torch.no_grad():
        observation = {name: array.torch() for name, array in simulator.observations.items()} | images_of(renderer, simulator)
        expected, expected_values = load_policy(path)(observation)
    # A sharp policy has logits of tens, which fp32 rounds in proportion: 1e-5 of the largest.
    for computed, wanted in ((logits.torch(), expected), (values.torch(), expected_values)):
        torch.testing.assert_close(computed, wanted, rtol=0, atol=1e-5 * max(1.0, wanted.abs().max().item()))


def test_controller_and_module_drive_identically(trained, session, town):
    simulator, again = world_of(session, town), world_of(session, town)
    controller = session.make_controller(simulator, renderer_of(session, simulator))
    assert controller.name == "policy"
    simulator.run(controller, 20)
    policy, renderer = load_policy(trained[1] / "policy.safetensors"), renderer_of(session, again)
    for _ in range(20):
        observation = {name: array.torch() for name, array in again.observations.items()} | images_of(renderer, again)
        again.step(policy.act(observation))
    assert simulator.state_hash() == again.state_hash() and simulator.totals()["agent_steps"] > 100
    sampled = session.make_controller(simulator, renderer_of(session, simulator), argmax=False, seed=3)
    assert (sampled.act(simulator)["kind"] == 0).all() and len(set(sampled.act(simulator)["action"])) > 1


def test_worlds_of_training_and_of_evaluation(session, town):
    training, evaluation = session.training_world(), session.evaluation_world(77)
    assert training["episode_steps"] == 60 and evaluation["episode_steps"] == 77
    assert set(training["conditioning"]) == set(pictura.CONDITIONING_NAMES)
    assert all(isinstance(value, float) for value in evaluation["conditioning"].values()) and evaluation["fixed_lights"]
    assert (training["light_cycles"], training["stagger_episodes"], training["reset_at_standstill"]) == ("phases", False, False)
    simulator = pictura.Simulator([town], [(0, 4)], **evaluation)
    assert len(np.unique(simulator.observations["conditioning"].numpy(), axis=0)) == 1


def test_errors_name_input_that_does_not_fit_a_session(trained, session, town):
    simulator = world_of(session, town, agents=5)
    observations = dict(simulator.observations.items())
    with pytest.raises(pictura.Error, match="evaluate: ego: expected f32"):
        session.evaluate(observations | {"ego": np.zeros((5, 9))})
    with pytest.raises(pictura.Error, match="got 'egg'"):
        session.evaluate({"egg": observations["ego"]})
    with pytest.raises(pictura.Error, match="got none"):
        session.evaluate({})
    del observations["ego"]
    renderer = renderer_of(session, simulator)
    seen = {"scene": simulator.scene, "views": simulator.views, "renderer": renderer} if renderer else {}
    with pytest.raises(pictura.Error, match="ego"):
        session.evaluate(observations, **seen)
    if renderer is not None:
        with pytest.raises(pictura.Error, match="renderer"):
            session.evaluate(simulator.observations)
        with pytest.raises(pictura.Error, match="expected a renderer"):
            session.make_controller(simulator)
    other = world_of(session, town, agents=5)
    with pytest.raises(pictura.Error, match="its own simulator"):
        session.make_controller(simulator, renderer).act(other)
    with pytest.raises(pictura.Error, match="nowhere.ckpt"):
        pictura.PolicySession("nowhere.ckpt")


def test_a_controller_outlives_its_session(trained, town):
    session = pictura.PolicySession(str(trained[1] / "checkpoint.ckpt"), device="cpu", num_threads=1)
    simulator = world_of(session, town, agents=4)
    controller = session.make_controller(simulator, renderer_of(session, simulator))
    del session
    simulator.run(controller, 3)


def options_of(arguments):
    """Returns the command's options for arguments of the functions."""
    names = {"agents_per_world": "agents", "num_threads": "threads", "sample_steps": "every"}
    return [f"--{names.get(name, name.removesuffix('_mps').replace('_', '-'))}={value}" for name, value in arguments.items()]


def visible_files(folder):
    """Returns the visible files, without the list of files that the command wrote."""
    return sorted(each.name for each in folder.iterdir() if not each.name.startswith("."))


def probed_by_command(probe, folder, out, arguments):
    """Returns the JSON that `pictura probe` prints for the same arguments as the function's; its files go to `out`."""
    command = os.environ.get("PICTURA_COMMAND")
    if not command:
        pytest.skip("PICTURA_COMMAND names no command")
    done = subprocess.run(
        [command, "probe", probe, str(folder / "checkpoint.ckpt"), "--map", "procedural:1", "--out", str(out), "--json", *options_of(arguments)],
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_concurrent_calls_of_a_session_or_renderer_are_refused(trained, session, town):
    simulators = [world_of(session, town) for _ in range(2)]
    renderers = [renderer_of(session, simulator) for simulator in simulators]
    controllers = [session.make_controller(*pair) for pair in zip(simulators, renderers)]
    calls = [lambda one=one, by=by: one.run(by, 1) for one, by in zip(simulators, controllers)]
    calls.append(lambda: session.evaluate(world_of(session, town).observations))
    if renderers[0] is not None:
        empty, views = pictura.Scene(np.zeros((0, 3)), [], np.zeros((0, 3)), []), pictura.make_views(np.zeros((200, 3)), np.zeros(200))
        calls.append(lambda: renderers[0].render(empty, views))
    errors, end = set(), time.monotonic() + 4

    def repeat(call):
        while time.monotonic() < end:
            try:
                call()
            except pictura.Error as error:
                errors.add(str(error))

    threads = [threading.Thread(target=repeat, args=(call,)) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert any("the controller's session: another thread is in a call of this object" in error for error in errors), errors
    simulators[0].run(controllers[0], 2)


def test_the_average_of_weights_is_loaded_and_evaluated(trained):
    folder = trained[1]
    checkpoint, average = str(folder / "checkpoint.ckpt"), str(folder / "policy_average.safetensors")
    weights, last = load_policy(checkpoint, average=True).state_dict(), load_policy(checkpoint).state_dict()
    assert all(torch.equal(value, weights[name]) for name, value in load_policy(average).state_dict().items())
    assert any(not torch.equal(value, weights[name]) for name, value in last.items())
    options = {"scenarios": 1, "steps": 5, "agents_per_world": 4, "num_threads": 2, "device": "cpu"}
    hashes = [
        pictura.evaluate(path, ["procedural:1"], average=of_average, **options)["policy_hash"]
        for path, of_average in [(checkpoint, True), (average, False), (checkpoint, False)]
    ]
    assert hashes[0] == hashes[1] != hashes[2]
    pictura.PolicySession(checkpoint, average=True, device="cpu")
    for refuse in (load_policy, pictura.PolicySession):
        with pytest.raises(pictura.Error, match=r"policy_average\.safetensors: holds one set of weights"):
            refuse(average, average=True)


def test_a_policy_decides_at_the_requested_interval(trained):
    checkpoint = str(trained[1] / "checkpoint.ckpt")
    options = {"scenarios": 1, "steps": 30, "agents_per_world": 8, "num_threads": 2, "device": "cpu", "argmax": False}
    returns = [
        pictura.evaluate(checkpoint, ["procedural:1"], decision_steps=steps, **options)["rows"][0]["return_per_vehicle"] for steps in (0, 1, 3)
    ]
    assert returns[0] == returns[1] != returns[2], "it was trained to decide at every step"
    with pytest.raises(pictura.UsageError, match="decision_steps: expected 0 to 1000, got -1"):
        pictura.PolicySession(checkpoint, device="cpu", decision_steps=-1)
    for device in ("cpu:0", "cuda:x", "cuda:-1"):
        with pytest.raises(pictura.UsageError, match=f"device: expected one of cpu, cuda, cuda:N, auto; got '{device}'"):
            pictura.PolicySession(checkpoint, device=device)
    with pytest.raises(pictura.UsageError, match="decision_steps: expected a trained policy, got the controller lane"):
        pictura.evaluate("", ["procedural:1"], controller="lane", decision_steps=3)


def test_evaluation_matches_the_command(trained):
    command = os.environ.get("PICTURA_COMMAND")
    folder, done = trained[1], []
    options = {"scenarios": 2, "steps": 40, "agents_per_world": 6, "num_threads": 2, "device": "cpu"}
    # Sampled actions, since the most likely action of a policy that has hardly learned may stand still.
    report = pictura.evaluate(
        str(folder / "checkpoint.ckpt"), ["procedural:1"], argmax=False, on_progress=lambda fraction, eta_s: done.append(fraction), **options
    )
    (row,) = report["rows"]
    assert row["scenarios"] == 2 and row["vehicle_episodes"] == 12 and done and done[-1] == 1
    if not command:
        pytest.skip("PICTURA_COMMAND names no command")
    out = subprocess.run(
        [command, "evaluate", str(folder / "checkpoint.ckpt"), "--map", "procedural:1", "--sampled", "--json", *options_of(options)],
        capture_output=True, text=True,
    )  # fmt: skip
    assert out.returncode == 0, out.stderr
    (theirs,) = json.loads(out.stdout)["rows"]
    assert theirs["km_driven"] == pytest.approx(row["km_driven"], rel=1e-6) and row["km_driven"] > 0
    assert json.loads(out.stdout)["policy_hash"] == report["policy_hash"]


def replay_of(page):
    """Returns the header of a replay, and its case."""
    header = json.loads(re.search(r'id="replay-header">(.*?)</script>', page.read_text()).group(1))
    return header, header["case"]


def row_of_case(cases, number):
    with open(cases, newline="") as file:
        return list(csv.DictReader(file))[number]


def test_removal_matches_the_command(trained, tmp_path):
    modality, folder, _, _ = trained
    done, cases = [], tmp_path / "cases.csv"
    options = {"scenes": 2, "steps": 40, "removals": 60, "sample_steps": 2, "agents_per_world": 20, "seed": 3, "num_threads": 2, "device": "cpu"}
    report = pictura.probe_removal(
        [str(folder / "checkpoint.ckpt")], ["procedural:1"], cases_file=str(cases), on_progress=lambda fraction, eta_s: done.append(fraction),
        **options)  # fmt: skip
    # Fewer cases than requested if a processor's rounding makes this policy's agents halt earlier.
    number = report["cases"]
    assert report["kind"] == "removal" and 40 <= number <= report["cases_asked"] == 60 and done[-1] == 1
    (policy,) = report["policy"]
    assert policy["reads_images"] == (modality == "perspective") and policy["scenes_driven"] == 2 and policy["cases_driven"] == number
    assert sum(row["cases"] for row in report["rows"] if row["distance_from_m"] is None) == number
    lines = cases.read_text().splitlines()
    assert len(lines) == 1 + number and lines[0].startswith("case,scene,map,driver,step,ego,user,hidden,class")
    page, few_cases, few = tmp_path / "case.html", tmp_path / "few.csv", {**options, "removals": 8}
    pictura.probe_removal([str(folder / "checkpoint.ckpt")], ["procedural:1"], cases_file=str(few_cases), replay=str(page), case=3, cameras=True, **few)
    header, case = replay_of(page)
    row = row_of_case(few_cases, 3)
    assert (case["frame"], case["ego"], case["removed"]) == (int(row["step"]), int(row["ego"]), int(row["hidden"]))
    assert header["followed"] == case["ego"] and header["images"]
    assert case["frame"] < header["frames"] <= 41, "fewer where all of this policy's agents have halted by then"
    for wrong in ({"replay": "case.png"}, {"case": 3}, {"replay": str(page), "case": 10**6}):
        with pytest.raises(pictura.UsageError, match="replay|case"):
            pictura.probe_removal([str(folder / "checkpoint.ckpt")], ["procedural:1"], **wrong, **few)
    unchanged = pictura.probe_removal([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="unchanged", **options)
    assert unchanged["control"] == "unchanged" and all(row["abs_d_value"] in (0, None) for row in unchanged["rows"])
    with pytest.warns(DeprecationWarning, match="control: 'nobody' is deprecated: use 'unchanged'"):
        renamed = pictura.probe_removal([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="nobody", **options)
    assert renamed["control"] == "unchanged" and renamed["rows"] == unchanged["rows"]
    untrained_cases = tmp_path / "untrained.csv"
    untrained = pictura.probe_removal([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="untrained", cases_file=str(untrained_cases), **options)
    assert untrained["control"] == "untrained" and untrained["cases"] == number and untrained["policy"][0]["untrained_hash"] != policy["policy_hash"]
    assert policy["untrained_hash"] is None and untrained["policy"][0]["policy_hash"] == policy["policy_hash"]
    theirs_of_state, mine = ([line.split(",")[:14] for line in each.read_text().splitlines()] for each in (untrained_cases, cases))
    assert theirs_of_state == mine and untrained_cases.read_text() != cases.read_text()
    with pytest.raises(pictura.UsageError, match="none, unchanged, permuted, untrained"):
        pictura.probe_removal([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="some")
    theirs = probed_by_command("removal", folder, tmp_path / "out", options)
    assert theirs["rows"] == report["rows"]
    assert (tmp_path / "out" / "cases.csv").read_text() == cases.read_text()
    assert (tmp_path / "out" / "removal.png").exists() and json.loads((tmp_path / "out" / "summary.json").read_text()) == theirs


@pytest.mark.parametrize("trained", ["vector"], indirect=True)  # minutes with images; the common part is compared above
def test_pedestrian_matches_the_command(trained, tmp_path):
    _, folder, _, _ = trained
    done, cases = [], tmp_path / "cases.csv"
    options = {"scenes": 2, "steps": 60, "paths": 2, "sample_steps": 4, "min_speed_mps": -10, "agents_per_world": 30, "seed": 3, "num_threads": 2, "device": "cpu"}
    report = pictura.probe_pedestrian(
        [str(folder / "checkpoint.ckpt")], ["procedural:1"], cases_file=str(cases), replay=str(tmp_path / "case.html"), on_progress=lambda fraction, eta_s: done.append(fraction),
        **options)  # fmt: skip
    header, case = replay_of(tmp_path / "case.html")
    shown = row_of_case(cases, int(re.match(r"case (\d+):", case["what"]).group(1)))
    assert (case["frame"], case["ego"]) == (int(shown["step"]), int(shown["ego"]))
    assert header["origin_m"][0] + case["inserted"]["x_cm"] / 100 == pytest.approx(float(shown["x_m"]), abs=0.006), "places in a page are relative to the map's origin"
    assert header["images"] is None
    assert report["kind"] == "pedestrian" and report["paths"] in (1, 2) and report["paths_asked"] == 2 and done[-1] == 1
    assert sum(row["cases"] for row in report["rows"] if row["phase"]) == report["cases"]
    lines = cases.read_text().splitlines()
    assert len(lines) == 1 + report["cases"] and lines[0].startswith("case,path,scene,map,driver,step,ego")
    unchanged = pictura.probe_pedestrian([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="unchanged", **options)
    assert all(row["abs_d_value"] == 0 for row in unchanged["rows"])
    untrained = pictura.probe_pedestrian([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="untrained", **options)
    assert untrained["cases"] == report["cases"] and untrained["rows"] != report["rows"]
    with pytest.raises(pictura.UsageError, match="none, unchanged, untrained, got 'some'"):
        pictura.probe_pedestrian([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="some")
    theirs = probed_by_command("pedestrian", folder, tmp_path / "out", options)
    assert theirs["rows"] == report["rows"]
    assert (tmp_path / "out" / "cases.csv").read_text() == cases.read_text()
    drawn = [f"path_{path:03}.png" for path in range(report["paths"])]
    assert visible_files(tmp_path / "out") == ["cases.csv", *drawn, "pedestrian.png", "summary.json"]


@pytest.mark.parametrize("trained", ["vector"], indirect=True)  # minutes with images; the common part is compared above
def test_corner_matches_the_command(trained, tmp_path):
    _, folder, _, _ = trained
    done, cases = [], tmp_path / "cases.csv"
    options = {"scenes": 2, "steps": 300, "pairs": 1, "driver": "lane", "agents_per_world": 90, "seed": 3, "num_threads": 2, "device": "cpu"}
    report = pictura.probe_corner(
        [str(folder / "checkpoint.ckpt")], ["procedural:1"], cases_file=str(cases), replay=str(tmp_path / "pair.html"), on_progress=lambda fraction, eta_s: done.append(fraction),
        **options)  # fmt: skip
    assert report["kind"] == "corner" and report["pairs"] == report["pairs_asked"] == 1 and report["driver"] == "lane" and done[-1] == 1
    assert report["cases"] == 2 * 3 and report["policy"][0]["scenes_driven"] == 0
    hidden, removed, empty = report["rows"][:3]
    assert [row["case"] for row in (hidden, removed, empty)] == ["hidden", "removed", "empty"] and hidden["runs"] == 1
    assert hidden["speed_curve_mps"][0] == removed["speed_curve_mps"][0] and len(hidden["speed_curve_mps"]) == 81
    assert hidden["speed_curve_mps"][0] == pytest.approx(empty["speed_curve_mps"][0], abs=0.5)
    lines = cases.read_text().splitlines()
    assert len(lines) == 1 + report["cases"] and lines[0].startswith("run,pair,walls,case,policy,scene,map,driver,step,ego,user")
    with pytest.raises(pictura.UsageError, match="expected one pair or more, got 0"):
        pictura.probe_corner([str(folder / "checkpoint.ckpt")], ["procedural:1"], pairs=0)
    assert report["control"] == "none"
    with pytest.raises(pictura.UsageError, match="none, permuted, untrained"):
        pictura.probe_corner([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="unchanged")
    untrained = pictura.probe_corner([str(folder / "checkpoint.ckpt")], ["procedural:1"], control="untrained", **options)
    assert untrained["pairs"] == 1 and untrained["rows"] != report["rows"]
    assert untrained["rows"][0]["speed_curve_mps"][0] == hidden["speed_curve_mps"][0]
    _, case = replay_of(tmp_path / "pair.html")
    shown = row_of_case(cases, 0)
    assert (case["frame"], case["ego"]) == (0, int(shown["ego"])), "it begins where the policy takes over"
    theirs = probed_by_command("corner", folder, tmp_path / "out", options)
    assert theirs["rows"] == report["rows"]
    assert (tmp_path / "out" / "cases.csv").read_text() == cases.read_text()
    assert visible_files(tmp_path / "out") == ["cases.csv", "corner.png", "example.png", "summary.json"]


def test_the_documents_code_runs(tmp_path, monkeypatch, town):
    monkeypatch.chdir(tmp_path)
    text = (pathlib.Path(__file__).parents[2] / "docs/reference/python/training.md").read_text()
    (block,) = [each for each in re.findall(r"```python\n(.*?)```", text, re.S) if "pictura.train(" in each]
    names = {"pictura": pictura, "town": town}
    exec(compile(block.replace("configs/smoke.toml", SMOKE), "docs/reference/python/training.md", "exec"), names)  # noqa: S102
    assert names["logits"].shape == (16, 12) and names["rows"][0]["vehicle_episodes"] > 0


def test_a_controller_is_evaluated_without_a_policy():
    report = pictura.evaluate("", ["procedural:1"], controller="lane", scenarios=1, steps=100, agents_per_world=8, device="cpu")
    assert report["rows"][0]["km_driven"] > 0.05 and (report["policy_hash"], report["light_cycles"]) == ("lane", "phases")
    with pytest.raises(pictura.UsageError, match="light_cycles: expected phases, independent, got 'alone'"):
        pictura.evaluate("", ["procedural:1"], controller="lane", light_cycles="alone")
    with pytest.raises(pictura.UsageError, match="expected one map"):
        pictura.evaluate("", [], controller="lane")
    with pytest.raises(pictura.UsageError, match="densities: expected light, medium, dense, got 'thick'"):
        pictura.evaluate("", ["procedural:1"], controller="lane", densities=["thick"])
    with pytest.raises(pictura.UsageError, match="light_heads: expected as_mapped, visible, got 'seen'"):
        pictura.evaluate("", ["procedural:1"], controller="lane", light_heads="seen")
    with pytest.raises(pictura.UsageError, match="samples: expected .*, got 'many'"):
        pictura.evaluate("", ["procedural:1"], controller="lane", samples="many")


def test_functions_are_evaluated_as_controllers(tmp_path):
    maps, options = ["procedural:1"], {"scenarios": 2, "steps": 60, "agents_per_world": 8, "device": "cpu"}
    seen = []

    def idle(observations):
        seen.append(observations)
        return np.full(len(observations["ego"]), pictura.IDLE_ACTION)

    report = pictura.evaluate("", maps, controller=idle, **options)
    assert report["policy_hash"] == "function idle"
    expected = pictura.evaluate("", maps, controller="idle", **options)
    assert repr(report["rows"]) == repr(expected["rows"]) and report["agent_steps"] == expected["agent_steps"]
    shapes = {name: (rows, numbers) if rows > 1 else (numbers,) for name, _, rows, numbers in pictura.OBSERVATION_ARRAYS if name != "walls"}
    assert {name: values.shape[1:] for name, values in seen[0].items() if name != "walls"} == shapes
    assert not np.shares_memory(seen[0]["ego"], seen[1]["ego"]), "copies, which stay"

    class Throttle:
        def __call__(self, observations):
            return torch.full((len(observations["ego"]),), 10)

    assert pictura.evaluate("", maps, controller=Throttle(), **options)["rows"][0]["km_driven"] > report["rows"][0]["km_driven"]
    for wrong, message in (
        (lambda _: None, r"function <lambda>: expected actions, integers \[\d+\], got"),
        (lambda seen: np.zeros((len(seen["ego"]), 2), int), r"expected actions, integers \[\d+\], got int64 \(\d+, 2\)"),
        (lambda seen: np.zeros(len(seen["ego"])), r"expected actions, integers \[\d+\], got float64"),
        (lambda seen: np.full(len(seen["ego"]), 12), r"expected actions in \[0, 12\), got 12 for slot 0"),
    ):
        with pytest.raises(pictura.UsageError, match=message):
            pictura.evaluate("", maps, controller=wrong, **options)
    with pytest.raises(ZeroDivisionError):
        pictura.evaluate("", maps, controller=lambda _: 1 / 0, **options)
    with pytest.raises(TypeError, match="controller"):
        pictura.evaluate("", maps, controller=3, **options)


def test_functions_receive_camera_images():
    maps, options = ["procedural:1"], {"scenarios": 1, "steps": 8, "agents_per_world": 8, "device": "cpu", "width_px": 32, "height_px": 18}
    seen = []

    def idle(observations):
        seen.append(observations)
        return np.full(len(observations["ego"]), pictura.IDLE_ACTION)

    report = pictura.evaluate("", maps, controller=idle, **options)
    assert repr(report["rows"]) == repr(pictura.evaluate("", maps, controller="idle", **{**options, "width_px": 0, "height_px": 0})["rows"])
    images = seen[0]["rgb"]
    assert images.shape == (8, 4, 3, 18, 32) and images.dtype == np.uint8
    assert all(image.std() > 5 for image in images.reshape(-1, 3, 18, 32)), "every camera sees something"
    plain = [observations["rgb"] for observations in seen]
    seen.clear()
    pictura.evaluate("", maps, controller=idle, camera_severity=1, **options)
    assert len(seen) == len(plain) and not np.array_equal(seen[0]["rgb"], plain[0])
    # The same images as those of a separate renderer in the same world.
    simulator = pictura.Simulator([pictura.Map.load(maps[0])], [(0, 8, 0x80000000)], seed=1, episode_steps=8, fixed_lights=True)
    renderer = pictura.Renderer("cpu", pictura.Rig.paper(32, 18))
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    assert np.array_equal(np.asarray(renderer.render(simulator.scene, simulator.views).blocks[0]), plain[0])
    with pytest.raises(pictura.UsageError, match="rig: has its own sizes"):
        pictura.evaluate("", maps, controller=idle, rig="front.toml", **options)
    with pytest.raises(pictura.UsageError, match="camera_severity: expected a policy that reads images"):
        pictura.evaluate("", maps, controller=idle, camera_severity=1, **{**options, "width_px": 0, "height_px": 0})


PROBED = {"scenes": 2, "steps": 30, "sample_steps": 2, "agents_per_world": 20, "num_threads": 1}


@pytest.mark.parametrize("trained", ["vector"], indirect=True)
def test_functions_are_probed_as_policies(trained, tmp_path):
    _, folder, _, _ = trained
    saved = str(folder / "checkpoint.ckpt")
    network = pictura.torch.load_policy(saved)

    def twin(observations):
        with torch.no_grad():
            return network(observations)

    cases = tmp_path / "cases.csv"
    report = pictura.probe_removal([saved, twin], ["procedural:1"], removals=60, cases_file=str(cases), device="cpu", **PROBED)
    rows = list(csv.DictReader(cases.open(newline="")))
    assert len(rows) == report["cases"] > 20 and [policy["policy_hash"] for policy in report["policy"]][1] == "function twin"
    for what in ("value", "d_value", "p_brake", "d_p_brake"):
        theirs, own = ([float(row[f"{name}/{what}"]) for row in rows] for name in (report["policy"][0]["name"], "function twin"))
        np.testing.assert_allclose(own, theirs, atol=1e-4)
        assert np.ptp(own) > 0


def test_functions_drive_through_corners():
    def brake(observations):
        return np.full(len(observations["ego"]), 1)

    def hurry(observations):
        return np.full(len(observations["ego"]), 10)

    options = {"scenes": 2, "steps": 300, "pairs": 1, "driver": "lane", "agents_per_world": 90, "seed": 3, "num_threads": 2}
    report = pictura.probe_corner([brake, hurry], ["procedural:1"], **options)
    assert report["pairs"] == 1
    braking, hurrying = ([row["speed_curve_mps"] for row in report["rows"] if row.get("policy") == f"function {name}" and "speed_curve_mps" in row] for name in ("brake", "hurry"))
    assert len(braking) == len(hurrying) == 6 and all(curve[0] == other[0] and curve[5] < curve[0] and other[5] > curve[5] for curve, other in zip(braking, hurrying))


def test_functions_that_return_actions_have_no_values(tmp_path):
    maps, cases = ["procedural:1"], tmp_path / "cases.csv"

    def careful(observations):
        return np.where(observations["set_counts"][:, 0] > 6, 0, 10)  # brakes among more than six partners

    report = pictura.probe_removal([careful], maps, removals=60, range_m=20, cases_file=str(cases), **PROBED)
    rows = list(csv.DictReader(cases.open(newline="")))
    assert {row["function careful/value"] for row in rows} == {"nan"}
    brakes = {float(row["function careful/d_p_brake"]) for row in rows}
    assert brakes <= {0.0, 1.0} and all(row["abs_d_value"] is None and row["changed_share"] in (None, row["abs_d_p_brake"]) for row in report["rows"])

    seen = []

    def watching(observations):
        seen.append(observations)
        return np.full(len(observations["ego"]), pictura.IDLE_ACTION)

    pictura.probe_removal([watching], maps, removals=8, width_px=32, height_px=18, **PROBED)
    drives, responds = seen[0], seen[-1]
    assert drives["rgb"].shape == (40, 4, 3, 18, 32) and responds["rgb"].shape[1:] == (4, 3, 18, 32) and drives["partners"].shape == (40, 16, 8)
    assert all(image.std() > 5 for image in responds["rgb"].reshape(-1, 3, 18, 32)), "every camera sees something"

    few = {"removals": 8, **PROBED}
    floats = np.zeros((40, 12), np.float32)
    for wrong, message in (
        (lambda _: None, r"function <lambda>: expected actions, integers \[40\], got object"),
        (lambda _: np.full(40, 12), r"expected actions in \[0, 12\), got 12 for slot 0"),
        (lambda _: (floats,), r"expected logits, floats \[40, 12\], and values, floats \[40\], got \(float32 \(40, 12\)\)"),
        (lambda _: (floats, floats), r"values, floats \[40\], got \(float32 \(40, 12\), float32 \(40, 12\)\)"),
        (lambda _: (floats, floats[:, 0] + np.nan), "expected finite logits and values"),
    ):
        with pytest.raises(pictura.UsageError, match=message):
            pictura.probe_removal([wrong], maps, **few)
    with pytest.raises(ZeroDivisionError):
        pictura.probe_removal([lambda _: 1 / 0], maps, **few)
    for options, message in (
        ({"control": "untrained"}, "function careful: expected a saved policy"),
        ({"replay": "case.html"}, "replay: expected saved policies, got function careful"),
        ({"device": "cuda"}, "device: expected auto or cpu for function careful, got cuda"),
        ({"decision_steps": 2}, "decision_steps: expected trained policies, got function careful"),
    ):
        with pytest.raises(pictura.UsageError, match=message):
            pictura.probe_removal([careful], maps, **options, **few)
    with pytest.raises(TypeError, match="policies"):
        pictura.probe_removal([3], maps, **few)


def test_actions_follow_the_logits_of_a_function():
    maps, options = ["procedural:1"], {"scenarios": 1, "steps": 40, "agents_per_world": 8, "device": "cpu"}
    logits = np.tile(np.float32([0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 3, 2]), (8, 1))

    def throttle(observations):
        return logits, np.zeros(8)

    rows = pictura.evaluate("", maps, controller=throttle, **options)["rows"]
    assert repr(rows) == repr(pictura.evaluate("", maps, controller=lambda _: np.full(8, 10), **options)["rows"])
    draws = [pictura.evaluate("", maps, controller=throttle, argmax=False, seed=seed, **options)["rows"] for seed in (1, 1, 2)]
    assert repr(draws[0]) == repr(draws[1]) != repr(draws[2]) and repr(draws[0]) != repr(rows)


def test_functions_run_in_the_robust_protocol():
    def throttle(observations):
        return np.full(len(observations["ego"]), pictura.IDLE_ACTION)

    report = pictura.evaluate_robust("", controller=throttle, scenarios=1)
    rows = {row["name"]: row for row in report["rows"]}
    assert rows["impaired"]["not_driven"] is None and rows["severity 1"]["not_driven"] == "sees no images"
    assert rows["grid towns"]["steps"] == 1200 and set(report["pooled"]) == {"towns", "others", "all"}
    assert report["pooled"]["all"]["vehicle_episodes"] > report["pooled"]["others"]["vehicle_episodes"] > 0
    with pytest.raises(pictura.UsageError, match="seed: has no effect"):
        pictura.evaluate_robust("", controller=throttle, seed=2)


def test_errors_suggest_the_nearest_argument():
    for function, name, nearest in (
        (pictura.train, "overides", "overrides"),
        (pictura.evaluate, "densitys", "densities"),
        (pictura.evaluate_robust, "scenario", "scenarios"),
        (pictura.evaluate_scenes, "protocoll", "protocol"),
        (pictura.probe_removal, "removal", "removals"),
        (pictura.probe_pedestrian, "hight_m", "height_m"),
        (pictura.probe_corner, "light_cycle", "light_cycles"),
    ):
        expected = rf"{function.__name__}\(\) got an unexpected keyword argument '{name}'; did you mean '{nearest}'\?"
        with pytest.raises(TypeError, match=expected):
            function([], [], **{name: 3})
    with pytest.raises(TypeError, match=r"PolicySession\(\) is missing the argument 'checkpoint'"):
        pictura.PolicySession(device="cpu")


def test_a_controller_is_evaluated_in_recorded_scenes(tmp_path):
    fixture = os.environ.get("PICTURA_SCENE_FIXTURE")
    if not fixture:
        pytest.skip("PICTURA_SCENE_FIXTURE names no writer of scenes")
    subprocess.run([fixture, "write", str(tmp_path)], check=True)
    options = {"controller": "idm", "device": "cpu", "densities": [1.0], "rules": {"leave_at_goal": "no"}, "steps": 60}
    report = pictura.evaluate_scenes("", [str(tmp_path / "womd.tfrecord")], **options)
    (row,) = report["rows"]
    assert report["scored"] == 1 and report["faults"] == [] and row["vehicle_episodes"] == len(report["agents"]) > 0
    assert report["agents"][0]["scenario_id"] == "fixture00000001" and report["agents"][0]["driven_steps"] > 0
    rollouts = tmp_path / "rollouts.binproto"
    options = {"controller": "random", "device": "cpu", "protocol": "simagents", "rollouts": str(rollouts), "realism": "2024"}
    report = pictura.evaluate_scenes("", [str(tmp_path / "womd.tfrecord")], **options)
    assert {agent["rollout"] for agent in report["agents"]} == set(range(32)) and rollouts.stat().st_size > 32 * 12 * 4 * 320
    assert report["realism"] == realism.score_file(rollouts, str(tmp_path / "womd.tfrecord"), version="2024")
    with pytest.raises(pictura.UsageError, match="expected 2024 or 2025, got '2023'"):
        pictura.evaluate_scenes("", [str(tmp_path)], **(options | {"realism": "2023"}))
    with pytest.raises(pictura.UsageError, match="expected 32 rollouts of 80 steps"):
        pictura.evaluate_scenes("", [str(tmp_path)], controller="idm", rollouts=str(rollouts))
    with pytest.raises(pictura.UsageError, match="rule late: expected replay, drive, absent, got 'never'"):
        pictura.evaluate_scenes("", [str(tmp_path)], controller="idm", rules={"late": "never"})


def test_an_exception_of_a_callback_ends_training(tmp_path):
    def fail(progress):
        raise ZeroDivisionError(progress["update"])

    with pytest.raises(ZeroDivisionError, match="1"):
        pictura.train(SMOKE, str(tmp_path / "run"), overrides=TRAIN, on_progress=fail)
    with pytest.raises(pictura.Error, match="train.updaets"):
        pictura.train(SMOKE, str(tmp_path / "other"), overrides=["train.updaets=2"])
    with pytest.raises(pictura.UsageError, match="old_run: expected"):
        pictura.train(SMOKE, str(tmp_path / "other"), old_run="keep")


def test_interrupted_training_saves_and_resumes(tmp_path):
    code = f"""
        import signal
        import pictura
        signal.signal(signal.SIGINT, signal.default_int_handler)
        def train(old_run, on_progress):
            pictura.train({SMOKE!r}, {str(tmp_path / "run")!r}, overrides=["train.updates=100000", "run.num_threads=1"],
                          old_run=old_run, on_progress=on_progress)
        try:
            train("refuse", lambda progress: print(progress["update"], flush=True))
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        def once(progress):
            print("again", progress["update"], flush=True)
            raise EOFError
        try:
            train("resume", once)
        except EOFError:
            print("ended")
    """
    with subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True) as process:
        lines = [process.stdout.readline(), process.stdout.readline()]
        process.send_signal(signal.SIGINT)
        lines += process.stdout.read().split("\n")
        assert process.wait(60) == 0
    lines = [line.strip() for line in lines if line.strip()]
    assert lines[:2] == ["1", "2"] and lines[-3:-1] == ["interrupted", f"again {int(lines[-4]) + 1}"] and lines[-1] == "ended"
    assert len(lines) < 20, "it went on for long after the interrupt"
