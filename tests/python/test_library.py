"""Maps, rigs, scenes, renderers and simulators: as in C++, with the same names."""

import pickle
import subprocess
import sys

import numpy as np
import pytest
from conftest import actions_of

import pictura


def test_a_map_has_facts_geometry_and_a_picture(town):
    assert town.name == "procedural:3"
    facts, arrays = town.facts, town.arrays()
    assert facts["lanes"] == len(arrays["lane_type"]) == len(arrays["lane_point_range"])
    begin, end = arrays["lane_point_range"][0]
    points = arrays["lane_points"][begin:end]
    steps = np.linalg.norm(np.diff(points[:, :3], axis=0), axis=1)
    assert end - begin >= 2 and steps.max() <= 10.01
    np.testing.assert_allclose(np.diff(points[:, 5]), steps, rtol=0.02)
    assert town.geometry().num_strips > 1000
    assert town.geometry(walls=False).num_walls == 0 < town.geometry().num_walls
    assert town.geometry(light_heads="visible").num_lights == facts["traffic_lights"]
    with pytest.raises(pictura.UsageError, match="as_mapped"):
        town.geometry(light_heads="seen")
    picture = town.draw(200, 150)
    assert picture.shape == (150, 200, 3) and len(np.unique(picture)) > 10


def test_errors_name_faults_of_map_text(tmp_path):
    with pytest.raises(pictura.Error, match="nowhere.xodr"):
        pictura.Map.from_text("<OpenDRIVE", "nowhere.xodr")
    with pytest.raises(pictura.UsageError, match="Town99"):
        pictura.Map.load("Town99")
    with pytest.raises(ValueError):
        pictura.Map.load("Town99")


def test_unpicklable_objects_raise_for_every_protocol(town):
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        with pytest.raises(TypeError, match="cannot pickle 'pictura._pictura.Map' object"):
            pickle.dumps(town, protocol=protocol)


def test_the_papers_rig_and_custom_rigs():
    rig = pictura.Rig.paper(48, 27)
    assert len(rig) == 4 and rig.cameras[0].width_px == 48
    assert rig.cameras[0].focal_x_px == pytest.approx(1545 * 48 / 1920)
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(rig, protocol=protocol))
        assert [(c.name, c.yaw_rad, c.position_m) for c in again.cameras] == [(c.name, c.yaw_rad, c.position_m) for c in rig.cameras]
    with pytest.raises(pictura.Error, match="camera"):
        pictura.Rig([pictura.Camera("wide", 0, 10)])


def test_a_scene_of_arrays_is_drawn_unchanged():
    rig = pictura.Rig([pictura.Camera("front", 64, 48, position_m=(0, 0, 1.5))])
    renderer = pictura.Renderer("cpu", rig, num_threads=1)
    renderer.upload(0, pictura.Geometry([([[0, -2, 0], [50, -2, 0]], 0.3, (1, 1, 1))]))
    scene = pictura.Scene([[15, 0, 0]], [0.0], [[4.5, 2, 1.5]], [0])
    views = pictura.make_views([[0, 0, 0]], [0.0])
    images = renderer.render(scene, views, planes=True)
    rgb, planes = images.rgb.numpy()[0, 0], images.planes(0)
    instance = planes["instance_id"].numpy()[0]
    depth = planes["depth_m"].numpy()[0]
    ys, xs = np.nonzero(instance == 1)
    assert 28 < xs.mean() < 36, "in the middle"
    assert depth[instance == 1].min() == pytest.approx(15 - 2.25, abs=0.05)
    assert np.isinf(depth[0, 0]) and rgb[:, 0, 0].max() == 0
    assert planes["class_id"].numpy()[0][instance == 1].max() > 0
    seen = renderer.visibility(scene, views, [[0, 0]])
    assert seen[0] == pytest.approx(1)
    floats = np.zeros((1, 1, 3, 48, 64), np.float32)
    assert renderer.render(scene, views, floats) is floats
    np.testing.assert_allclose(floats[0, 0] * 255, rgb, atol=0.51)


def test_scene_files(tmp_path):
    path = tmp_path / "car.toml"
    path.write_text(
        '[[view]]\nname = "behind"\nx_m = 0.0\ny_m = 0.0\nheading_deg = 0.0\n'
        '[[agent]]\nclass = "vehicle"\nx_m = 12.0\ny_m = 0.0\nheading_deg = 0.0\nlength_m = 4.5\nwidth_m = 1.9\nheight_m = 1.5\n'
    )
    scene_file = pictura.SceneFile(str(path))
    assert scene_file.view_names == ["behind"]
    renderer = pictura.Renderer("cpu", scene_file.rig, num_threads=1)
    renderer.upload(0, scene_file.geometry)
    images = renderer.render(scene_file.scene, scene_file.views)
    assert images.camera(0).numpy().max() > 0
    path.write_text("[[view]]\n")
    with pytest.raises(pictura.Error, match="car.toml"):
        pictura.SceneFile(str(path))


def test_errors_name_scenes_that_do_not_fit_a_renderer(make):
    simulator = make(3)
    renderer = pictura.Renderer("cpu", pictura.Rig.paper(16, 9), num_threads=1)
    with pytest.raises(pictura.Error, match="geometr"):
        renderer.render(simulator.scene, simulator.views)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    with pytest.raises(pictura.Error, match=r"render: out: expected u8 \[3, 4, 3, 9, 16\] on cpu"):
        renderer.render(simulator.scene, simulator.views, np.zeros((3, 4, 3, 9, 15), np.uint8))
    frozen = np.zeros((3, 4, 3, 9, 16), np.uint8)
    frozen.setflags(write=False)
    with pytest.raises(pictura.Error, match="on cpu, writable"):
        renderer.render(simulator.scene, simulator.views, frozen)
    with pytest.raises(pictura.UsageError, match="cpu"):
        pictura.Renderer("cpo")
    views = pictura.make_views([[0, 0, 0]], [0.0], world=[7])
    with pytest.raises(pictura.Error, match="world"):
        renderer.render(simulator.scene, views)


def test_many_views_drawn_in_parts_give_equal_images(make):
    simulator = make()
    renderer = pictura.Renderer("cpu", pictura.Rig.paper(8, 6), num_threads=2)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    views = np.tile(simulator.views.numpy(), (60, 1))  # 720, of which about 250 are drawn at a time
    one, many = (renderer.render(simulator.scene, some, planes=True) for some in (simulator.views, views))
    assert one.rgb.numpy().std() > 10
    assert (many.rgb.numpy().reshape(60, *one.rgb.shape) == one.rgb.numpy()).all()
    for camera in range(4):
        for name, plane in many.planes(camera).items():
            assert (plane.numpy().reshape(60, 12, 6, 8) == one.planes(camera)[name].numpy()).all(), name
    out = np.empty((720, 4, 3, 6, 8), np.float32)
    renderer.render(simulator.scene, views, out)
    assert (np.rint(out * 255) == many.rgb.numpy()).mean() > 0.999
    views.view(pictura.VIEW_DTYPE)["world"][700] = 9
    with pytest.raises(pictura.Error, match=r"views 5\d\d to 719: .*expected a world below 1, got 9"):
        renderer.render(simulator.scene, views)


def test_simulator_images_equal_those_of_the_render_command(make):
    simulator = make(4)
    renderer = pictura.Renderer("cpu", num_threads=1)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    first = renderer.render(simulator.scene, simulator.views).rgb.numpy()
    assert first.shape == (4, 4, 3, 54, 96) and first.mean() > 5
    views = simulator.views.numpy().view(pictura.VIEW_DTYPE)[:, 0]
    assert views["ego_agent"].tolist() == [0, 1, 2, 3]
    again = renderer.render(simulator.scene, views.copy()).rgb.numpy()
    assert (first == again).all()


def test_randomized_cameras_are_keyed_by_agent_and_step(make):
    simulator = make(4)
    views = simulator.views.numpy().view(pictura.VIEW_DTYPE)[:, 0].copy()
    assert views["key"]["agent"].tolist() == [0, 1, 2, 3] and set(views["key"]["step"].tolist()) == {0}

    def images(severity, views):
        renderer = pictura.Renderer("cpu", num_threads=1, camera_severity=severity)
        for handle, geometry in simulator.geometries.items():
            renderer.upload(handle, geometry)
        return renderer.render(simulator.scene, views).rgb.numpy().copy()

    plain, shaken = images(0, views), images(1, views)
    assert (shaken != plain).mean() > 0.1
    assert (images(1, views[::-1].copy())[::-1] == shaken).all()
    views["key"]["step"] += 1
    assert (images(0, views) == plain).all() and (images(1, views) != shaken).mean() > 0.1
    with pytest.raises(pictura.UsageError, match="camera_severity: expected 0 to 2, got 3"):
        pictura.Renderer("cpu", camera_severity=3)


def test_steps_are_deterministic_and_saved(make):
    a, b = make(seed=5, episode_steps=20), make(seed=5, episode_steps=20)
    for step in range(30):
        a.step(actions_of(step, 12))
        b.step(actions_of(step, 12))
    assert a.state_hash() == b.state_hash() != make(seed=6).state_hash()
    saved, kept = a.save(), a.snapshot()
    for step in range(10):
        a.step(actions_of(step, 12))
    later = a.state_hash()
    for back in (saved, kept):
        a.restore(back)
        assert a.state_hash() == b.state_hash()
        for step in range(10):
            a.step(actions_of(step, 12))
        assert a.state_hash() == later
    with pytest.raises(pictura.Error, match="seed"):
        make(seed=6, episode_steps=20).restore(saved)


def test_chosen_worlds_are_reset(make):
    simulator, other = make(6, worlds=3, seed=1), make(6, worlds=3, seed=9)
    for step in range(15):
        simulator.step(actions_of(step, 18))
    x = simulator.state["x_m"].numpy().copy()
    simulator.reset(np.array([0, 1, 0], bool), seed=9)
    now, fresh = simulator.state["x_m"].numpy(), other.state["x_m"].numpy()
    assert (now[6:12] == fresh[6:12]).all()
    assert (now[:6] == x[:6]).all() and (now[12:] == x[12:]).all()
    simulator.reset(seed=9)
    assert (simulator.state["x_m"].numpy() == fresh).all()


def test_chosen_agents_are_set(make):
    simulator = make(6)
    slots = np.array([4, 1], np.int32)
    before = simulator.state["x_m"].numpy().copy()
    place = {key: np.ascontiguousarray(simulator.state[key].numpy()[[4, 1]]) for key in ("x_m", "y_m", "z_m", "heading_rad")}
    place["speed_mps"] = np.array([3, 5], np.float32)
    simulator.set_state(slots, place)
    assert (simulator.state["x_m"].numpy() == before).all()
    assert simulator.state["speed_mps"].numpy()[[4, 1]].tolist() == [3, 5]
    assert simulator.observations["ego"].numpy()[4, 0] == pytest.approx(3 / 20)
    with pytest.raises(pictura.Error, match="did you mean 'speed_mps'"):
        simulator.set_state(slots, {"sped_mps": place["speed_mps"]})
    with pytest.raises(pictura.Error, match="slot 1: x_m: the value is out of range"):
        simulator.set_state(slots, {"x_m": np.array([0, np.nan], np.float32)})


def boxes_of(simulator) -> np.ndarray:
    return np.asarray(simulator.scene.boxes).view(pictura.BOX_DTYPE)[:, 0]


def test_queries_without_changes_equal_the_simulators_observations(make):
    simulator = make(12, worlds=2)
    for step in range(5):
        simulator.step(actions_of(step, 24))
    answers = simulator.observe(*pictura.make_queries([23, 4]))
    assert set(answers) == set(simulator.observations)
    for name, array in answers.items():
        expected = simulator.observations[name].numpy()[[23, 4]]
        assert array.shape == expected.shape and (array.numpy() == expected).all(), name
    before = simulator.state_hash()
    del simulator
    assert before and (answers["ego"].numpy() == answers["ego"].numpy()).all(), "answers keep their memory"


def test_boxes_are_hidden_and_inserted(make):
    simulator = make(12, parked_cars=0)
    boxes, counts = boxes_of(simulator), simulator.observations["set_counts"].numpy()
    distance_m = np.hypot(*(boxes["center_m"] - boxes["center_m"][0])[:, :2].T)
    nearest = int(np.argsort(distance_m)[1])
    phantom = np.zeros(1, pictura.INSERTED_DTYPE)
    phantom["box"], phantom["speed_mps"] = boxes[nearest], simulator.state["speed_mps"].numpy()[nearest]
    answers = simulator.observe(
        *pictura.make_queries([0, 0, 0, 0], hidden=[[nearest], [nearest], [nearest], []], inserted=[[], phantom, [], phantom],
                              leaves_gaps=[False, False, True, False]))
    partners, filled = answers["partners"].numpy(), answers["set_counts"].numpy()[:, 0]
    seen = simulator.observations["partners"].numpy()[0]
    assert filled.tolist() == [counts[0, 0] - 1, counts[0, 0], counts[0, 0], min(16, counts[0, 0] + 1)]
    assert (partners[1] == seen).all(), "a box in the place of itself"
    row = int(np.argmin(np.abs(seen - partners[2]).sum(1) == 0))
    assert (partners[2, row] == 0).all() and (seen[row] != 0).any() and (np.delete(partners[2], row, 0) == np.delete(seen, row, 0)).all()
    assert (partners[0, :-1] == np.delete(seen, row, 0)).all()
    # Repeats the queries with one list and offsets, into arrays of the caller.
    out = {name: np.full_like(array.numpy(), 7) for name, array in answers.items()}
    lists = pictura.make_queries(np.zeros(4, int), hidden=([nearest] * 3, [0, 1, 2, 3, 3]),
                                 inserted=(np.concatenate([phantom, phantom]), [0, 0, 1, 1, 2]), leaves_gaps=[0, 0, 1, 0])
    assert simulator.observe(*lists, out=out) is out
    assert all((out[name] == array.numpy()).all() for name, array in answers.items())


def test_errors_name_invalid_queries(make):
    simulator = make(4)
    for queries, message in [
        (pictura.make_queries([4]), "slot"),
        (pictura.make_queries([0], hidden=[[999]]), "999"),
        (pictura.make_queries([0], inserted=[np.array([(((np.nan, 0, 0), 1, 0, 4, 2, 1, 0, 0, 1, 0), 0)], pictura.INSERTED_DTYPE)]), "finite"),
    ]:
        with pytest.raises(pictura.Error, match=message):
            simulator.observe(*queries)
    with pytest.raises(pictura.Error, match="hidden: expected 1 lists, got 2"):
        pictura.make_queries([0], hidden=[[1], [2]])
    with pytest.raises(pictura.Error, match=r"inserted: expected \(list, begin\) with begin \[2\]"):
        pictura.make_queries([0], inserted=(np.zeros(0, pictura.INSERTED_DTYPE), [0]))
    queries, hidden, inserted = pictura.make_queries([0], hidden=[[1]])
    with pytest.raises(pictura.Error, match=r"observe: hidden: expected i32 \[1\] on cpu, got i64"):
        simulator.observe(queries, hidden.astype(np.int64))
    with pytest.raises(pictura.Error, match="observe: queries: expected structs of 24 bytes"):
        simulator.observe(inserted, hidden)
    whole = {name: np.empty((1, *array.shape[1:]), array.dtype) for name, array in simulator.observations.items()}
    with pytest.raises(pictura.Error, match=r"observe: out: ego: expected f32 \[1, 9\]"):
        simulator.observe(queries, hidden, out=whole | {"ego": np.empty((1, 8), np.float32)})
    with pytest.raises(pictura.Error, match="observe: out: ego: expected an array, got none"):
        simulator.observe(queries, hidden, out={name: array for name, array in whole.items() if name != "ego"})
    with pytest.raises(pictura.Error, match="expected 8 arrays"):
        simulator.observe(queries, hidden, out=whole | {"walls": np.empty((1, 80, 7), np.float32)})


def test_reward_terms_sum_to_rewards_and_totals(make):
    simulator = make(20)
    of_steps = np.zeros(11)
    for step in range(80):
        result = simulator.step(actions_of(step, 20))
        np.testing.assert_allclose(result.reward_terms.numpy().sum(axis=1), result.reward.numpy(), atol=1e-6)
        of_steps += result.reward_terms.numpy().sum(axis=0, dtype=float)
    totals = simulator.totals()
    np.testing.assert_allclose([totals["reward_terms"][name] for name in pictura.REWARD_TERMS], of_steps, atol=1e-6)
    assert totals["agent_steps"] > 100


def test_the_lane_keeper_drives_alone_and_shared(make):
    simulator = make(8, pedestrian_fraction=0.0)
    lane = pictura.Controller("lane", simulator)
    simulator.run(lane, 50)
    assert simulator.totals()["distance_m"] > 50
    commands = lane.act(simulator)
    commands["kind"][3] = 2
    simulator.step_commands(commands)
    assert simulator.state["status"].numpy()[3] == 3
    with pytest.raises(pictura.UsageError, match="lane"):
        pictura.Controller("nobody", simulator)


@pytest.mark.parametrize("name", ["random", "idm_lanes"])
def test_a_controller_is_refused_in_other_worlds(make, name):
    simulator = make(8)
    controller = pictura.Controller(name, simulator)
    simulator.run(controller, 3)
    other = pictura.Map.load("procedural:1:blocks=1x1")
    simulator.set_worlds([other], [(0, 8)])
    with pytest.raises(pictura.Error, match="expected its own simulator and worlds"):
        simulator.run(controller, 1)
    simulator.run(pictura.Controller(name, simulator), 3)


def test_conditioning_is_set_by_name(town):
    fixed = pictura.Simulator([town], [(0, 8)], conditioning={"collision": 2.5, "v_goal_mps": (3, 4)}, num_threads=1)
    values = fixed.state["conditioning"].numpy()
    vehicles = fixed.state["agent_class"].numpy() < 2
    assert (values[vehicles, 2] == 2.5).all() and (values[:, 1] >= 3).all() and (values[:, 1] <= 4).all()
    with pytest.raises(pictura.UsageError, match="did you mean 'collision'"):
        pictura.Simulator([town], [(0, 8)], conditioning={"colision": 2.5})


def test_errors_name_invalid_worlds(town):
    numbers = r"integers \(map, agents\) or \(map, agents, global world\)"
    for worlds, message in (
        ([(0, 4, -1)], f"world 0: expected {numbers}, got \\(0, 4, -1\\)"),
        ([(0, 4), ("a", 4)], f"world 1: expected {numbers}, got \\('a', 4\\)"),
        ([(0,)], numbers),
        ([3], numbers),
    ):
        with pytest.raises(pictura.UsageError, match=message):
            pictura.Simulator([town], worlds)
    for options, message in (
        ({"conditioning": {"collision": "a"}}, r"conditioning: collision: expected a number or \(low, high\), got 'a'"),
        ({"conditioning": {3: 1}}, "conditioning: expected names, got 3"),
        ({"stream": "x"}, "stream: expected a cudaStream_t as int, or None, got 'x'"),
        ({"seed": -1}, f"seed: expected 0 to {2**64 - 1}, got -1"),
    ):
        with pytest.raises(pictura.UsageError, match=message):
            pictura.Simulator([town], [(0, 4)], **options)
    for arguments, options, message in (
        ([[town], [(0, 4)]], {"wals": True}, r"Simulator\(\) got an unexpected keyword argument 'wals'; did you mean 'walls'\?"),
        ([[town]], {}, "is missing the argument 'worlds'"),
        ([[town], [(0, 4)]], {"maps": [town]}, "got two values for 'maps'"),
        ([[town], [(0, 4)], "cpu"], {}, "takes 2 positional arguments, got 3"),
        ([[town], [(0, 4)]], {"parked_cars": "many"}, r"Simulator\(\).*\n.*parked_cars: typing.SupportsInt[^\n]*\n\nInvoked with: 'many'"),
    ):
        with pytest.raises(TypeError, match=message):
            pictura.Simulator(*arguments, **options)
    for make in (pictura.Recorder, pictura.LiveView, pictura.SceneRecorder):
        with pytest.raises(pictura.UsageError, match="expected a pictura.Simulator, got NoneType"):
            make(None)
    with pytest.raises(pictura.Error, match="nowhere: expected a folder of replays"):
        pictura.write_gallery("nowhere")


@pytest.mark.parametrize("executor", ["auto", "cpu"])
def test_an_absent_device_is_refused(town, executor):
    device = "cuda:99"  # exists on no machine
    with pytest.raises(pictura.Error, match=device):
        pictura.Simulator([town], [(0, 4)], executor=executor, device=device)
    with pytest.raises(pictura.Error, match=device):
        pictura.Renderer(executor, device=device)


def test_replaced_worlds_equal_a_new_simulators(make, town):
    simulator, expected = make(6, worlds=2), make(9, worlds=4, seed=3)
    old = simulator.observations["ego"].numpy()
    kept = old.copy()
    simulator.set_worlds([town], [(0, 9)] * 4, seed=3)
    assert simulator.state_hash() == expected.state_hash()
    assert simulator.observations["ego"].shape == (36, 9)
    assert (old == kept).all(), "memory of before lives"
    other = pictura.Map.load("procedural:4")
    for maps, worlds in (([other], [(3, 1)]), ([other], [(0, -1)]), ([other], []), ([], [(0, 1)])):
        with pytest.raises(pictura.UsageError):
            simulator.set_worlds(maps, worlds)
        assert simulator.maps == [town] and simulator.num_slots == 36
    simulator.set_worlds([town], [(0, 6)], seed=3)
    assert simulator.num_slots == 6


def test_the_package_includes_the_command():
    folder = __import__("pathlib").Path(pictura.__file__).parent
    if not list((folder / "bin").glob("**/pictura")):
        pytest.skip("this package was built without the command")
    out = subprocess.run([sys.executable, "-m", "pictura", "--version"], capture_output=True, text=True)
    assert out.stdout.strip() == pictura.__version__, out.stderr
