"""Arrays: no copies, lifetimes, DLPack's protocol, and rejected arrays."""

import contextlib
import ctypes
import gc
import random
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import pictura


def test_numpy_and_dlpack_share_the_simulators_memory(make, idle):
    simulator = make()
    ego = simulator.observations["ego"]
    views = [np.asarray(ego), ego.numpy(), np.from_dlpack(ego)]
    assert len({view.ctypes.data for view in views}) == 1
    steps = simulator.episode_step.numpy()
    before = steps.copy()
    simulator.step(idle(simulator))
    assert steps[0] == before[0] + 1


def test_arrays_keep_their_simulator_alive(make, idle):
    simulator = make()
    result = simulator.step(idle(simulator))
    held = [np.asarray(simulator.observations["lanes"]), np.from_dlpack(simulator.state["x_m"]), result.reward.numpy()]
    copies = [array.copy() for array in held]
    capsule = simulator.observations["ego"].__dlpack__(max_version=(1, 0))
    del simulator, result
    gc.collect()
    blocks = [np.ones(1 << 16) for _ in range(20)]
    assert all((array == copy).all() for array, copy in zip(held, copies)) and blocks
    del capsule


def test_dlpack_supports_both_versions(make):
    simulator = make()
    ego, x_m = simulator.observations["ego"], simulator.state["x_m"]
    assert ego.__dlpack_device__() == (1, 0)
    assert "dltensor_versioned" in repr(ego.__dlpack__(max_version=(1, 0)))
    assert '"dltensor"' in repr(ego.__dlpack__())
    with pytest.raises(BufferError, match="read-only"):
        x_m.__dlpack__()
    assert not np.from_dlpack(x_m).flags.writeable and not np.asarray(x_m).flags.writeable
    copied = np.from_dlpack(x_m, copy=True)
    assert copied.ctypes.data != np.asarray(x_m).ctypes.data and (copied == np.asarray(x_m)).all()
    with pytest.raises(BufferError, match="dl_device"):
        ego.__dlpack__(dl_device=(2, 0), max_version=(1, 0))
    with pytest.raises(BufferError, match="stream"):
        ego.__dlpack__(stream=3)
    with pytest.raises(TypeError):
        ego.__dlpack__(color=3)
    for name, value in (("max_version", "new"), ("max_version", (1,)), ("dl_device", "cpu"), ("stream", "x"), ("copy", "yes")):
        with pytest.raises(pictura.UsageError, match=name):
            ego.__dlpack__(**{name: value})


def test_shared_arrays_keep_their_strides(make, idle):
    simulator = make()
    result = simulator.step(idle(simulator))
    terms = result.reward_terms
    assert terms.strides == (12, 1)
    assert (np.from_dlpack(terms) == terms.numpy()).all()
    assert (np.from_dlpack(terms, copy=True) == terms.numpy()).all()
    assert result.valid.numpy().dtype == bool


def test_torch_shares_memory_without_a_copy(make):
    torch = pytest.importorskip("torch")
    simulator = make()
    ego = simulator.observations["ego"].torch()
    assert ego.data_ptr() == simulator.observations["ego"].numpy().ctypes.data
    actions = torch.full((12,), pictura.IDLE_ACTION, dtype=torch.int32)
    simulator.step(actions)
    other = pictura.Simulator(simulator.maps, simulator.worlds, num_threads=1)
    other.step(actions.numpy())
    assert other.state_hash() == simulator.state_hash()
    valid = torch.from_dlpack(simulator.step(actions).valid)
    assert valid.dtype == torch.bool and bool(valid.any())
    renderer = pictura.Renderer("cpu", pictura.Rig.paper(16, 9), num_threads=1)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    out = torch.zeros(12, 4, 3, 9, 16, dtype=torch.float32)
    assert renderer.render(simulator.scene, simulator.views, out) is out and out.max() > 0
    bytes_, bfloats = (renderer.render(simulator.scene, simulator.views, torch.zeros(12, 4, 3, 9, 16, dtype=dtype)) for dtype in (torch.uint8, torch.bfloat16))
    assert torch.equal(bfloats, bytes_.to(torch.bfloat16)) and bytes_.max() > 100
    with pytest.raises(pictura.Error, match="expected i32"):
        simulator.step(torch.zeros(12, dtype=torch.int64))


def refusal(simulator, actions) -> str:
    before = simulator.state_hash()
    with pytest.raises(pictura.Error) as error:
        simulator.step(actions)
    assert simulator.state_hash() == before
    return str(error.value)


def test_errors_name_wrong_actions(make):
    simulator = make()
    good = np.zeros(24, np.int32)
    expected = "step: actions: expected i32 [12] on cpu"
    assert refusal(simulator, good) == f"{expected}, got i32 [24] on cpu"
    assert refusal(simulator, good[::2]) == f"{expected}, got i32 [12] on cpu with strides [2]"
    assert refusal(simulator, good[:12].astype(np.int64)) == f"{expected}, got i64 [12] on cpu"
    assert refusal(simulator, np.full(12, np.nan, np.float32)) == f"{expected}, got f32 [12] on cpu"
    assert refusal(simulator, good[:12].reshape(3, 4)) == f"{expected}, got i32 [3, 4] on cpu"
    assert refusal(simulator, [0] * 12) == "step: actions: expected an array with DLPack (NumPy, torch, ...), got list"
    assert refusal(simulator, np.full(12, 12, np.int32)).startswith("step: slot 0: expected an action in [0, 12), got 12")
    assert refusal(simulator, np.full(12, -1, np.int32)).endswith("got -1")
    assert "DLPack's code 0 with 8 bits" in refusal(simulator, good[:12].astype(np.int8))
    assert "None" in refusal(simulator, None)
    assert "aligned for i32" in refusal(simulator, np.zeros(12 * 4 + 1, np.uint8)[1:].view(np.int32))


def test_an_array_with_one_element_has_any_stride(make):
    simulator = make(1)
    simulator.step(np.zeros(8, np.int32)[::8])


class Odd:
    """Array that misstates one property of its tensor."""

    def __init__(self, array, **lies):
        self.array, self.lies = array, lies

    def __dlpack__(self, **arguments):
        result = self.lies.get("capsule", "honest")
        if isinstance(result, Exception):
            raise result
        return self.array.__dlpack__(**arguments) if result == "honest" else result

    def __dlpack_device__(self):
        return self.lies.get("device", (1, 0))


def test_inconsistent_array_protocols_are_refused(make):
    simulator = make()
    good = np.full(12, pictura.IDLE_ACTION, np.int32)
    simulator.step(Odd(good))
    for lies in ({"capsule": None}, {"capsule": 7}, {"capsule": "text"}):
        with pytest.raises(pictura.Error, match="capsule"):
            simulator.step(Odd(good, **lies))
    with pytest.raises(ZeroDivisionError):
        simulator.step(Odd(good, capsule=ZeroDivisionError()))
    with pytest.raises((pictura.Error, TypeError, RuntimeError, ValueError)):
        simulator.step(Odd(good, device="nowhere"))
    used = good.__dlpack__()
    np.from_dlpack(Odd(good, capsule=used))
    with pytest.raises(pictura.Error, match="capsule"):
        simulator.step(Odd(good, capsule=used))


def test_fuzzed_arrays_are_accepted_or_refused(make):
    simulator = make()
    renderer = pictura.Renderer("cpu", pictura.Rig.paper(8, 8), num_threads=1)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    types = [np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64, np.float16, np.float32]
    types += [np.float64, np.complex64, np.bool_, pictura.VIEW_DTYPE, pictura.COMMAND_DTYPE, np.dtype("U3"), np.dtype(object)]
    draw = random.Random(3)
    taken = 0
    for _ in range(3000):
        shape = tuple(draw.choice([0, 1, 2, 4, 12, 12, 12, 28, 40]) for _ in range(draw.randrange(0, 7)))
        if np.prod(shape, dtype=float) > 1e6:
            continue
        array = np.zeros(shape, draw.choice(types))
        for _ in range(draw.randrange(3)):
            if array.ndim:
                axis = draw.randrange(array.ndim)
                cut = [slice(None)] * array.ndim
                cut[axis] = draw.choice([slice(None, None, -1), slice(None, None, 2), slice(1, None), slice(0, 0)])
                array = array[tuple(cut)]
                if draw.random() < 0.3:
                    array = array.T
        if draw.random() < 0.1:
            array = np.broadcast_to(array, (12, *array.shape)) if array.ndim < 5 else array
        calls = [
            lambda: simulator.step(array),
            lambda: simulator.step_commands(array),
            lambda: simulator.reset(array, 3),
            lambda: simulator.set_state(array, {}),
            lambda: simulator.set_state(np.array([1], np.int32), {draw.choice(pictura.AGENT_FIELDS)[0]: array}),
            lambda: renderer.render(simulator.scene, array),
            lambda: renderer.render(simulator.scene, simulator.views, array),
        ]
        try:
            draw.choice(calls)()
            taken += 1
        except (pictura.Error, BufferError, TypeError, ValueError):
            pass
    assert 0 < taken < 1000
    simulator.step(np.zeros(12, np.int32))


class Tensor(ctypes.Structure):
    """DLPack tensor whose every number a test may choose."""

    _fields_ = [
        ("data", ctypes.c_void_p), ("device_type", ctypes.c_int32), ("device_id", ctypes.c_int32), ("ndim", ctypes.c_int32),
        ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
        ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)), ("byte_offset", ctypes.c_uint64),
        ("manager_ctx", ctypes.c_void_p), ("deleter", ctypes.c_void_p),
    ]  # fmt: skip


class Lender:
    """Lends memory as a tensor of any type, shape, strides and device."""

    memory = np.full(4096, pictura.IDLE_ACTION, np.int32)
    living: list["Lender"] = []  # the end of a tensor's life is not reported

    def __init__(self, shape, strides=None, device=(1, 0), said=None, dtype=(0, 32, 1), data=True, ndim=None):
        self.shape = (ctypes.c_int64 * max(len(shape), 1))(*shape)
        self.strides = None if strides is None else (ctypes.c_int64 * max(len(strides), 1))(*strides)
        self.tensor = Tensor(self.memory.ctypes.data if data else None, *device, len(shape) if ndim is None else ndim, *dtype)
        self.tensor.shape = self.shape
        if strides is not None:
            self.tensor.strides = self.strides
        self.said = said or device
        self.living.append(self)

    def __dlpack_device__(self):
        return self.said

    def __dlpack__(self, stream=None):
        new = ctypes.pythonapi.PyCapsule_New
        new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
        return new(ctypes.addressof(self.tensor), b"dltensor", None)


def test_tensors_of_any_device_type_shape_and_stride_are_accepted_or_refused(make):
    simulator = make()
    simulator.step(Lender([12]))
    for device, said in (((2, 0), None), ((2, 7), (1, 0)), ((1, 0), (2, 0)), ((10, 0), None), ((13, 0), (1, 0)), ((-1, -1), None)):
        lender = Lender([12], device=device, said=said)
        if device == (1, 0) and pictura.HAS_CUDA:
            simulator.step(lender)  # on the CPU, whatever the tensor declares
        else:
            assert "cpu" in refusal(simulator, lender)
    assert "null address" in refusal(simulator, Lender([12], data=False))
    for shape, ndim in (([-12], None), ([2**62, 4], None), ([2**40] * 3, None), ([12], -1), ([12], 9), ([12] * 6, None)):
        refusal(simulator, Lender(shape, ndim=ndim))
    draw = random.Random(5)
    taken = 0
    for _ in range(5000):
        shape = [draw.choice([12, 12, 12, 1, 0, 28, 40, 5, -1, 2**31, 2**62]) for _ in range(draw.choice([1, 1, 1, 0, 2, 3, 5, 6]))]
        strides = [draw.choice([1, 1, 1, 0, -1, 2, 28, 2**40, -(2**62)]) for _ in shape] if draw.random() < 0.5 else None
        dtype = (draw.choice([0, 0, 0, 1, 2, 4, 5, 6, 255]), draw.choice([32, 32, 32, 8, 16, 64, 1, 0, 255]), draw.choice([1, 1, 1, 0, 4]))
        device = (draw.choice([1, 1, 1, 3, 2, 4, 7, 13, 0, -5]), draw.choice([0, 0, 0, 1, -1, 99]))
        lender = Lender(shape, strides, device, draw.choice([None, (1, 0)]), dtype, draw.random() < 0.95)
        calls = [
            lambda: simulator.step(lender),
            lambda: simulator.step_commands(lender),
            lambda: simulator.reset(lender, 3),
            lambda: simulator.set_state(np.array([1], np.int32), {"speed_mps": lender}),
            lambda: simulator.observe(np.zeros(1, pictura.QUERY_DTYPE), lender),
        ]
        try:
            draw.choice(calls)()
            taken += 1
        except (pictura.Error, BufferError):
            pass
    assert 0 < taken < 2500
    simulator.step(np.zeros(12, np.int32))


def test_observations_may_be_overwritten(make, idle):
    written, kept = make(worlds=2, wall_observations=True), make(worlds=2, wall_observations=True)
    junk = np.random.default_rng(0)
    for step in range(20):
        for array in written.observations.values():
            view = array.numpy()
            if view.flags.writeable:
                view[...] = junk.integers(0, 256, view.nbytes, dtype=np.uint8).view(view.dtype).reshape(view.shape)
        for simulator in (written, kept):
            simulator.step(idle(simulator))
    assert written.state_hash() == kept.state_hash()
    assert (written.observations["set_counts"].numpy() == kept.observations["set_counts"].numpy()).all()


def test_array_destructors_may_call_the_simulator(make):
    simulator = make()
    called = []

    class Last(np.ndarray):
        def __del__(self):
            simulator.step(np.zeros(12, np.int32))
            called.append(True)

    for _ in range(20):
        simulator.step(np.zeros(12, np.int32).view(Last))
        simulator.set_state(np.array([1], np.int32), {"speed_mps": np.ones(1, np.float32)})
    assert len(called) == 20


def test_uninitialized_objects_are_refused():
    classes = [value for value in vars(pictura._pictura).values() if isinstance(value, type) and not issubclass(value, Exception)]
    refused = 0
    for its_class in classes:
        unmade = its_class.__new__(its_class)
        for member in dir(unmade):
            if not member.startswith("__") or member in ("__array__", "__dlpack__", "__dlpack_device__", "__len__", "__repr__"):
                with contextlib.suppress(TypeError, ImportError):
                    try:
                        value = getattr(unmade, member)
                        if callable(value):
                            value()
                    except (pictura.Error, RuntimeError) as error:
                        refused += "only by __new__" in str(error)
    assert len(classes) > 15 and refused > 50


def test_concurrent_calls_of_one_simulator_are_refused(town):
    simulator = pictura.Simulator([town], [(0, 60)] * 4, num_threads=1)
    lane = pictura.Controller("lane", simulator)
    errors, actions = [], np.zeros(240, np.int32)
    worker = threading.Thread(target=simulator.run, args=(lane, 60))
    worker.start()
    while worker.is_alive():
        try:
            simulator.totals()
        except pictura.Error as error:
            errors.append(str(error))
        time.sleep(0.001)
    worker.join()
    assert errors and "another thread is in a call of this object" in errors[0]
    simulator.step(actions)


def test_two_threads_use_two_simulators_at_once(town):
    def run(out):
        simulator = pictura.Simulator([town], [(0, 16)], num_threads=1, seed=4)
        for _ in range(40):
            simulator.step(np.full(16, 10, np.int32))
        out.append(simulator.state_hash())

    hashes: list[int] = []
    threads = [threading.Thread(target=run, args=(hashes,)) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(hashes) == 3 and len(set(hashes)) == 1


def run_python(code: str, **options) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=120, **options)


def test_interrupts_end_long_calls():
    code = """
        import os, signal, threading, time
        import pictura
        signal.signal(signal.SIGINT, signal.default_int_handler)  # it is ignored where the tests run in the background
        town = pictura.Map.load("procedural:3")
        simulator = pictura.Simulator([town], [(0, 20)], num_threads=1)
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        try:
            simulator.run(pictura.Controller("idle", simulator), 10**9)
        except KeyboardInterrupt:
            print("stopped", simulator.totals()["slot_steps"] > 0)
    """
    out = run_python(code)
    assert out.stdout == "stopped True\n", out.stderr


def test_interrupts_end_a_render_between_views():
    code = """
        import os, signal, threading
        import numpy as np
        import pictura
        signal.signal(signal.SIGINT, signal.default_int_handler)
        town = pictura.Map.load("procedural:3")
        simulator = pictura.Simulator([town], [(0, 20)], num_threads=1)
        renderer = pictura.Renderer("cpu", pictura.Rig.paper(32, 18), num_threads=1)
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
        views = np.tile(simulator.views.numpy(), (1000, 1))
        images = renderer.make_images(len(views))
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        try:
            renderer.render(simulator.scene, views, images)
        except KeyboardInterrupt:
            print("stopped", images.rgb[0].any(), images.rgb[-1].any())
        renderer.render(simulator.scene, views[:20])
    """
    out = run_python(code)
    assert out.stdout == "stopped True False\n", out.stderr


@pytest.mark.parametrize("work", ["simulator.run(lane, 10**9)", "step()", "draw()", "load()"])
def test_the_interpreter_exits_while_threads_run(work):
    code = f"""
        import threading, time
        import numpy as np
        import pictura
        town = pictura.Map.load("procedural:3")
        simulator = pictura.Simulator([town], [(0, 60)] * 4, num_threads=1)
        lane = pictura.Controller("lane", simulator)
        renderer = pictura.Renderer("cpu", pictura.Rig.paper(32, 18), num_threads=1)
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
        def step(): simulator.step(np.full(240, 10, np.int32))
        def draw(): renderer.render(simulator.scene, simulator.views)
        def load(): pictura.Map.load("procedural:5")
        def work():
            while True: {work}
        threading.Thread(target=work, daemon=True).start()
        time.sleep(0.2)
        print("left")
    """
    out = run_python(code)
    assert (out.returncode, out.stdout) == (0, "left\n"), out.stderr


def test_forks_are_refused_or_work():
    code = """
        import os, sys
        import numpy as np
        import pictura
        town = pictura.Map.load("procedural:3")
        threads = int(sys.argv[1]) if len(sys.argv) > 1 else {threads}
        simulator = pictura.Simulator([town], [(0, 20)] * 2, num_threads=threads)
        simulator.step(np.zeros(40, np.int32))
        child = os.fork()
        if child == 0:
            try:
                simulator.step(np.zeros(40, np.int32))
                print("stepped", flush=True)
            except pictura.Error as error:
                print(error, flush=True)
            os._exit(0)
        os.waitpid(child, 0)
    """
    assert run_python(code.format(threads=1)).stdout == "stepped\n"
    assert "forked" in run_python(code.format(threads=2)).stdout


def test_repr_describes_the_object(make):
    assert repr(make().observations["ego"]) == "<pictura.Array ego: f32 [12, 9] on cpu>"
