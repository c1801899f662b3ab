"""Python package on a CUDA device: the CPU's numbers, without copies, on the caller's stream. Skipped without a device,
unless PICTURA_REQUIRE_GPU=1 requires one."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest
from conftest import actions_of

import pictura

# JAX would take three quarters of the device's memory, which other tests use at the same time.
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")
torch = pytest.importorskip("torch")
if not (pictura.HAS_CUDA and torch.cuda.is_available()):
    if os.environ.get("PICTURA_REQUIRE_GPU") == "1":
        pytest.fail(f"expected a CUDA device: built with CUDA {pictura.HAS_CUDA}, torch's {torch.cuda.is_available()}", pytrace=False)
    pytest.skip("no CUDA device", allow_module_level=True)


@pytest.fixture
def both(town):
    worlds = [(0, 40)] * 3
    return (
        pictura.Simulator([town], worlds, executor="cpu", seed=3, episode_steps=50),
        pictura.Simulator([town], worlds, device="cuda", seed=3, episode_steps=50),
    )


def drawn(simulator, **options):
    renderer = pictura.Renderer("auto", pictura.Rig.paper(48, 27), device=simulator.device, **options)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    return renderer


def test_steps_and_images_equal_those_of_the_cpu(both):
    cpu, cuda = both
    assert cuda.name == "cuda" and cuda.observations["ego"].__dlpack_device__() == (2, 0)
    draw_cpu, draw_cuda = drawn(cpu), drawn(cuda)
    assert draw_cuda.name == "cuda"
    ego = torch.from_dlpack(cuda.observations["ego"])
    for step in range(120):
        actions = actions_of(step, 120)
        a, b = cpu.step(actions), cuda.step(torch.from_numpy(actions).cuda())
        assert (torch.from_dlpack(b.reward).cpu().numpy() == a.reward.numpy()).all()
        if step % 30 == 0:
            assert (ego.cpu().numpy() == cpu.observations["ego"].numpy()).all()
            images = torch.from_dlpack(draw_cuda.render(cuda.scene, cuda.views).rgb).cpu().numpy()
            assert (images == draw_cpu.render(cpu.scene, cpu.views).rgb.numpy()).all()
    assert cpu.state_hash() == cuda.state_hash() and cpu.totals() == cuda.totals()


def test_chosen_worlds_and_agents(both):
    cpu, cuda = both
    slots = np.array([3, 90], np.int32)
    speed = np.array([4, 6], np.float32)
    cpu.set_state(slots, {"speed_mps": speed})
    cuda.set_state(torch.from_numpy(slots).cuda(), {"speed_mps": torch.from_numpy(speed).cuda()})
    cpu.reset(np.array([1, 0, 0], np.uint8), 8)
    cuda.reset(torch.tensor([True, False, False], device="cuda"), 8)
    assert cpu.state_hash() == cuda.state_hash()
    cuda.set_state(torch.from_numpy(slots).cuda(), {"x_m": torch.full((2,), float("nan"), device="cuda")})
    with pytest.raises(pictura.Error, match="in an earlier call: slot 3: x_m"):
        cuda.check()
    cuda.reset(seed=9)
    cpu.reset(seed=9)
    assert cpu.state_hash() == cuda.state_hash()


def test_arrays_on_another_device_are_refused(both):
    _, cuda = both
    with pytest.raises(pictura.Error, match=r"step: actions: expected i32 \[120\] on cuda:0, got i32 \[120\] on cpu"):
        cuda.step(np.zeros(120, np.int32))
    with pytest.raises(TypeError, match="cuda:0"):
        cuda.observations["ego"].numpy()
    cuda.step(torch.full((120,), 99, dtype=torch.int32, device="cuda"))
    with pytest.raises(pictura.Error, match="got 99"):
        cuda.check()


def test_calls_wait_for_work_of_another_stream(town):
    stream = torch.cuda.Stream()
    simulator = pictura.Simulator([town], [(0, 40)] * 64, device="cuda", stream=stream.cuda_stream)
    expected = pictura.Simulator([town], [(0, 40)] * 64, executor="cpu")
    for step in range(20):
        actions = actions_of(step, 2560)
        # Created on torch's current stream, read on the simulator's stream, whose result is read on torch's again.
        result = simulator.step(torch.from_numpy(actions).cuda())
        reward = torch.from_dlpack(result.reward).clone()
        assert (reward.cpu().numpy() == expected.step(actions).reward.numpy()).all()
        torch.cuda.current_stream().wait_stream(stream)
        stream.wait_stream(torch.cuda.current_stream())


def test_policies_decide_on_the_stream_of_their_simulator(town):
    session = pictura.PolicySession(str(pathlib.Path(__file__).parents[2] / "models" / "vector.safetensors"), device="cuda")
    options = {**session.evaluation_world(100), "device": "cuda"}
    states = []
    for stream in (0, torch.cuda.Stream().cuda_stream):
        simulator = pictura.Simulator([town], [(0, 40)] * 64, stream=stream, **options)
        simulator.run(session.make_controller(simulator), 100)
        states.append(simulator.state_hash())
    assert states[0] == states[1]


def test_memory_outlives_the_simulator(town):
    simulator = pictura.Simulator([town], [(0, 40)], device="cuda")
    ego = torch.from_dlpack(simulator.observations["ego"])
    copy = ego.clone()
    del simulator
    torch.empty(1 << 24, device="cuda").fill_(1)
    assert torch.equal(ego, copy)


def test_a_fork_after_use_of_cuda_is_refused():
    code = """
import os, pictura, torch
simulator = pictura.Simulator([pictura.Map.load("procedural:3")], [(0, 4)], device="cuda")
actions = torch.full((4,), 10, dtype=torch.int32, device="cuda")
simulator.step(actions)
simulator.check()
child = os.fork()
if child == 0:
    try:
        simulator.totals()
    except pictura.Error as error:
        print(error, flush=True)
    os._exit(0)
os.waitpid(child, 0)
print(simulator.step(actions).reward.torch().shape)
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert "forked after CUDA was used" in out.stdout and "torch.Size([4])" in out.stdout, out.stdout + out.stderr


@pytest.mark.parametrize("name", ["jax", "cupy"])
def test_other_array_libraries_share_memory_and_pass_actions(both, name):
    module = pytest.importorskip(name)
    cpu, cuda = both
    take, make = (module.dlpack.from_dlpack, module.numpy.asarray) if name == "jax" else (module.from_dlpack, module.asarray)
    for step in range(3):
        actions = actions_of(step, 120)
        a, b = cpu.step(actions), cuda.step(make(actions))
        shared = [(cuda.observations["ego"], cpu.observations["ego"])]
        if name == "cupy":  # JAX cannot learn that results are read-only, since it uses DLPack before 1.0
            shared.append((b.reward, a.reward))
        for theirs, ours in shared:
            theirs = take(theirs)
            assert ((theirs.get() if name == "cupy" else np.asarray(theirs)) == ours.numpy()).all()


def test_environments_stay_on_the_device():
    pytest.importorskip("gymnasium")
    envs = pictura.make_vec("procedural:3", 16, num_worlds=8, device="cuda", observation="images", rig=pictura.Rig.paper(32, 18))
    seen, _ = envs.reset(seed=1)
    for _ in range(10):
        seen, reward, *_ = envs.step(torch.full((128,), 10, device="cuda"))
    assert seen["rgb"].is_cuda and reward.is_cuda and int(seen["rgb"].max()) > 0
