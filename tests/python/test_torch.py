"""Policies in Python: the same numbers as in C++, and weights that the command accepts."""

import copy
import json
import os
import pathlib
import random
import re
import struct
import subprocess

import numpy as np
import pytest

import pictura

torch = pytest.importorskip("torch")
from pictura.torch import Policy, _read_safetensors, export_onnx, load_policy, save_policy  # noqa: E402

MODELS = sorted((pathlib.Path(__file__).parents[2] / "models").rglob("*.safetensors"))
NAMES = (
    "vector", "vector_points", "perspective", "perspective_points", "patches", "normalized", "normalized_convolutions", "concatenated_queries",
    "concatenated_queries_mlp", "segments",
)  # fmt: skip


@pytest.fixture(scope="session")
def reference(tmp_path_factory) -> pathlib.Path:
    program = os.environ.get("PICTURA_POLICY_REFERENCE")
    if not program:
        pytest.skip("PICTURA_POLICY_REFERENCE names no program: the library was built without torch")
    folder = tmp_path_factory.mktemp("reference")
    subprocess.run([program, str(folder)], check=True)
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_logits_and_values_equal_those_of_the_library(reference, name):
    policy = load_policy(reference / f"{name}.safetensors")
    _, tensors = _read_safetensors(str(reference / f"{name}_io.safetensors"))
    if "rgb" in tensors:
        tensors["rgb"] = tensors["rgb"].to(torch.uint8)
    with torch.no_grad():
        logits, value = policy(tensors)
    assert tensors["logits"].std() > 0.01
    torch.testing.assert_close(logits, tensors["logits"], rtol=0, atol=1e-5)
    torch.testing.assert_close(value, tensors["value"], rtol=0, atol=1e-5)


def test_saved_weights_are_read_back(reference, tmp_path):
    policy = load_policy(reference / "vector.safetensors")
    with torch.no_grad():
        policy.actor.bias += 1
    save_policy(policy, tmp_path / "mine.safetensors", like=reference / "vector.safetensors")
    again = load_policy(tmp_path / "mine.safetensors")
    assert all(torch.equal(a, b) for a, b in zip(policy.state_dict().values(), again.state_dict().values()))
    other = load_policy(reference / "perspective.safetensors")
    with pytest.raises(pictura.Error, match="its architecture differs from the policy"):
        save_policy(other, tmp_path / "x.safetensors", like=reference / "vector.safetensors")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.safetensors"]


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_released_weights_are_read_and_written(path, tmp_path):
    policy = load_policy(path)
    assert all(value.dtype == torch.float32 for value in policy.state_dict().values())
    save_policy(policy, tmp_path / "again.safetensors", like=path)
    assert (tmp_path / "again.safetensors").read_bytes() == path.read_bytes()


def test_removed_keys_accept_only_their_fixed_value(reference):
    policy = load_policy(reference / "vector.safetensors")
    for name, kept, other, message in (
        ("goal_features", False, True, "policy.goal_features: expected false, got true: distances to goals were removed"),
        ("critic_layers", 0, 2, "policy.critic_layers: expected 0, got 2: separate trunks of the critic were removed"),
        ("value_head", "linear", "two_hot", 'policy.value_head: expected "linear", got "two_hot": other heads were removed'),
    ):
        Policy(policy.config | {name: kept}).load_state_dict(policy.state_dict())
        with pytest.raises(pictura.UsageError, match=message):
            Policy(policy.config | {name: other})


def test_errors_name_broken_files(reference, tmp_path):
    whole = (reference / "vector.safetensors").read_bytes()
    for name, data in (("empty", b""), ("short", whole[:1000]), ("text", b"x" * 100), ("cut", whole[:-100])):
        path = tmp_path / f"{name}.safetensors"
        path.write_bytes(data)
        with pytest.raises(pictura.Error, match=name):
            load_policy(path)
    path = tmp_path / "wrong.ckpt"
    path.write_bytes(whole)
    with pytest.raises(pictura.Error, match="PICTCKPT"):
        load_policy(path)


def header_and_tensors(path):
    whole = path.read_bytes()
    (length,) = struct.unpack_from("<Q", whole)
    return json.loads(whole[8 : 8 + length]), whole[8 + length :]


def write_safetensors(path, header, tensors):
    text = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + tensors)


@pytest.mark.skipif(not MODELS, reason="no released policies here")
def test_errors_name_broken_headers(tmp_path):
    whole, tensors = header_and_tensors(MODELS[-1])
    draw, refused, path = random.Random(1), 0, tmp_path / "odd.safetensors"
    odd = [None, 3, "x", [], {}, [-1], [0, 2**60], [5, 3], [1, 2, 3], [0, 4.5], 2**70, "I32", {"config": 3}, {"config": "[policy]"}]
    odd += [{"config": f'[policy]\nmodality="vector"\nembedding_width={width}\nbackbone_layers=2\nbackbone_width=3'} for width in (-1, 10**12)]
    for _ in range(300):
        header = copy.deepcopy(whole)
        name = draw.choice(list(header))
        changed = draw.choice([header, header[name]])
        changed[draw.choice([key for key in changed if changed is not header or key == name])] = draw.choice(odd)
        write_safetensors(path, header, tensors)
        for work in (load_policy, lambda path: save_policy(torch.nn.Linear(1, 1), tmp_path / "x.safetensors", like=path)):
            try:
                work(path)
            except pictura.Error as error:
                assert "odd.safetensors" in str(error)
                refused += 1
    assert refused > 400


@pytest.mark.skipif(not MODELS, reason="no released policies here")
def test_sizes_in_broken_headers_allocate_no_memory(tmp_path):
    """A system that overcommits memory would grant terabytes, and fill them until it ends the process."""
    header, tensors = header_and_tensors(MODELS[-1])
    path = tmp_path / "huge.safetensors"
    config = header["__metadata__"]["config"]
    header["__metadata__"]["config"] = re.sub(r"embedding_width = \d+", "embedding_width = 1000000000", config)
    assert header["__metadata__"]["config"] != config
    write_safetensors(path, header, tensors)
    with pytest.raises(pictura.Error, match=r"(?s)huge\.safetensors: .*size mismatch"):
        load_policy(path)


def test_a_policy_drives_the_simulator(reference, make):
    simulator = make(6)
    policy = load_policy(reference / "vector_points.safetensors")
    seen = {name: array.torch() for name, array in simulator.observations.items()}
    simulator.step(policy.act(seen))
    simulator.step(policy.act(seen, argmax=False))
    assert simulator.totals()["agent_steps"] > 0


def test_the_command_runs_weights_saved_by_python(tmp_path):
    command = os.environ.get("PICTURA_COMMAND")
    if not command or "train" not in subprocess.run([command, "--help"], capture_output=True, text=True).stdout:
        pytest.skip("PICTURA_COMMAND names no command that was built with torch")
    run = tmp_path / "run"
    smoke = pathlib.Path(__file__).parents[2] / "configs" / "smoke.toml"
    settings = ["policy.modality=vector", "train.updates=1", "run.num_threads=1"]
    sets = [part for setting in settings for part in ("--set", setting)]
    train = [command, "train", "--config", str(smoke), "--out", str(run), "--device", "cpu", *sets]
    out = subprocess.run(train, capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
    policy = load_policy(run / "checkpoint.ckpt")
    exported = load_policy(run / "policy.safetensors")
    assert all(torch.equal(a, b) for a, b in zip(policy.state_dict().values(), exported.state_dict().values()))
    half = tmp_path / "half.safetensors"
    out = subprocess.run([command, "export", str(run / "checkpoint.ckpt"), "--out", str(half)], capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
    for exact, rounded in zip(policy.state_dict().values(), load_policy(half).state_dict().values()):
        assert torch.equal(exact.to(torch.bfloat16).to(torch.float32), rounded)
    with torch.no_grad():
        policy.actor.weight.zero_()
        policy.actor.bias.copy_(torch.from_numpy(np.eye(12, dtype=np.float32)[10]))
    save_policy(policy, tmp_path / "throttle.ckpt", like=run / "checkpoint.ckpt")
    save_policy(policy, tmp_path / "throttle.safetensors", like=half)
    seen = {}
    for checkpoint in (run / "checkpoint.ckpt", tmp_path / "throttle.ckpt", tmp_path / "throttle.safetensors"):
        out = subprocess.run(
            [command, "simulate", "procedural:1", "--agents", "4", "--steps", "20", "--threads", "1", "--policy", str(checkpoint), "--json"],
            capture_output=True, text=True,
        )  # fmt: skip
        assert out.returncode == 0, out.stderr
        seen[checkpoint.name] = json.loads(out.stdout)["km_driven"]
    assert seen["throttle.ckpt"] > seen["checkpoint.ckpt"] > 0, "it does nothing but accelerate"
    assert seen["throttle.safetensors"] == seen["throttle.ckpt"]


def run_onnx(path, observation):
    """Returns logits and values of ONNX Runtime on the CPU."""
    runtime = pytest.importorskip("onnxruntime")
    session = runtime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    assert [each.name for each in session.get_inputs()] == list(observation)
    return [torch.from_numpy(each) for each in session.run(["logits", "value"], {name: each.numpy() for name, each in observation.items()})]


def drawn_observation(policy, like, rows: int):
    """Returns rows of arrays as in `like`, with new random scales, counts and pixels."""
    draw = torch.Generator().manual_seed(1)
    observation = {}
    for name in policy.observation_names:
        values = like[name].repeat(-(-rows // len(like[name])), *[1] * (like[name].ndim - 1))[:rows]
        if values.is_floating_point() and name != "rgb":
            values = values * torch.rand(len(values), *[1] * (values.ndim - 1), generator=draw) * 2
        elif name == "rgb":
            values = torch.randint(0, 256, values.shape, generator=draw, dtype=torch.uint8)
        else:
            values = torch.randint(0, 11, values.shape, generator=draw, dtype=torch.int32)
        observation[name] = values.reshape(-1, 3, 3) if name == "waypoints" else values
    return observation


@pytest.mark.parametrize("name", ["segments", "perspective_points"])
def test_onnx_models_match_the_policy(reference, tmp_path, name):
    pytest.importorskip("onnxscript")
    policy = load_policy(reference / f"{name}.safetensors")
    _, tensors = _read_safetensors(str(reference / f"{name}_io.safetensors"))
    if "rig" not in policy.metadata and policy.modality == "perspective":
        with pytest.raises(pictura.UsageError, match="image size"):
            export_onnx(policy, tmp_path / "policy.onnx")
        policy.metadata["rig"] = [{"size_px": [tensors["rgb"].shape[4], tensors["rgb"].shape[3]]}] * policy.num_cameras
    export_onnx(policy, tmp_path / "policy.onnx")
    assert [path.name for path in tmp_path.iterdir()] == ["policy.onnx"]
    for rows in (1, 10_000 if policy.modality == "vector" else 1_000):
        observation = drawn_observation(policy, tensors, rows)
        logits, value = run_onnx(tmp_path / "policy.onnx", observation)
        with torch.no_grad():
            expected, expected_value = policy(observation)
        torch.testing.assert_close(logits, expected, rtol=0, atol=1e-4)
        torch.testing.assert_close(value, expected_value, rtol=0, atol=1e-4)
        best = expected.topk(2).values
        is_clear = best[:, 0] - best[:, 1] > 2 * (logits - expected).abs().amax(1)
        assert is_clear.float().mean() > 0.9 and (logits.argmax(1) == expected.argmax(1))[is_clear].all()


def test_onnx_models_of_cameras_of_two_sizes(reference, tmp_path):
    onnx = pytest.importorskip("onnx")
    pytest.importorskip("onnxscript")
    policy = load_policy(reference / "patches.safetensors")
    _, tensors = _read_safetensors(str(reference / "patches_io.safetensors"))
    height, width = tensors["rgb"].shape[3:]
    policy.metadata["rig"] = [{"size_px": [width, height]}] * policy.num_cameras
    policy.metadata["rig"][-1] = {"size_px": [2 * width, height]}
    export_onnx(policy, tmp_path / "policy.onnx")
    observation = drawn_observation(policy, tensors, 5)
    blocks = [observation.pop("rgb")[:, :-1], torch.randint(0, 256, (5, 1, 3, height, 2 * width), dtype=torch.uint8)]
    logits, _ = run_onnx(tmp_path / "policy.onnx", observation | {"rgb_0": blocks[0].contiguous(), "rgb_1": blocks[1]})
    with torch.no_grad():
        torch.testing.assert_close(logits, policy(observation | {"rgb": blocks})[0], rtol=0, atol=1e-4)
    model = onnx.load(tmp_path / "policy.onnx")
    assert [(each.domain, each.version) for each in model.opset_import] == [("", 20)]
    facts = json.loads({each.key: each.value for each in model.metadata_props}["pictura"])
    assert facts["rig"] == policy.metadata["rig"] and "path" not in facts


def test_onnx_models_need_their_packages(reference, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "onnxscript", None)
    with pytest.raises(pictura.Error, match="expected the package onnx"):
        export_onnx(load_policy(reference / "vector.safetensors"), tmp_path / "policy.onnx")
