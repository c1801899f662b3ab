"""Environments: the checkers of each library, and checks that these lack."""

import warnings

import numpy as np
import pytest

import pictura

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402

from pictura.envs.gymnasium_env import DriveEnv  # noqa: E402
from pictura.envs.gymnasium_vector import AgentStatistics  # noqa: E402

SMALL = {"rig": pictura.Rig.paper(16, 9)}


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"observation": "flat", "actions": "multi_discrete", "others": "idle"},
        {"observation": "images", "others": "random", **SMALL},
        {"observation": "both", "others": lambda seen: np.full(len(seen["ego"]), 10), **SMALL},
    ],
    ids=["vector", "flat", "images", "both"],
)
def test_drive_passes_the_gymnasium_checker(options):
    env = gymnasium.make("pictura/Drive-v0", num_agents=6, **options)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*(infinity|maximum|minimum|flattened).*")
        check_env(env.unwrapped, skip_render_check=True)


def test_drive_renders_and_ends():
    env = gymnasium.make("pictura/Drive-v0", num_agents=4, render_mode="rgb_array", episode_steps=12)
    env.reset(seed=1)
    assert env.render().shape == (480, 640, 3)
    for step in range(12):
        _, reward, terminated, truncated, info = env.step(7)
        if terminated or truncated:
            break
    assert (step == 11 and truncated) or terminated
    with pytest.raises(pictura.Error, match="Discrete"):
        env.unwrapped.step(12)


def test_other_agents_drive_while_the_agent_stands():
    env = gymnasium.make("pictura/Drive-v0", num_agents=8, pedestrian_fraction=0.0).unwrapped
    env.reset(seed=3)
    for _ in range(40):
        env.step(7)
    distance = env.batch.simulator.state["distance_m"].numpy()
    assert distance[env._slot] == 0 and (np.delete(distance, env._slot) > 5).sum() >= 4


def vector(autoreset="next_step", **options):
    options = {"num_agents": 8, "num_worlds": 3, "episode_steps": 25, "num_threads": 1} | options
    return pictura.make_vec("procedural:3", autoreset=autoreset, **options)


@pytest.mark.parametrize("observation", ["vector", "flat", "images", "both"])
@pytest.mark.parametrize("actions", ["discrete", "multi_discrete"])
def test_vector_spaces_contain_returned_values(observation, actions):
    env = vector(observation=observation, actions=actions, **(SMALL if observation in ("images", "both") else {}))
    assert env.num_envs == 24
    seen, info = env.reset(seed=3)
    assert env.observation_space.contains(seen)
    env.action_space.seed(3)
    for _ in range(5):
        seen, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert env.observation_space.contains(seen)
        assert reward.shape == terminated.shape == truncated.shape == info["active"].shape == (24,)
        assert terminated.dtype == truncated.dtype == bool and reward.dtype == np.float32


@pytest.mark.parametrize("autoreset", ["next_step", "same_step"])
def test_vector_seeds_determine_all_results(autoreset):
    runs = []
    for seed in (5, 5, 6):
        env = vector(autoreset)
        seen, _ = env.reset(seed=seed)
        rewards = []
        for step in range(60):
            seen, reward, *_ = env.step(np.full(24, (step * 5) % 12))
            rewards.append(reward)
        runs.append((np.array(rewards), seen["ego"]))
    assert (runs[0][0] == runs[1][0]).all() and (runs[0][1] == runs[1][1]).all()
    assert not (runs[0][0] == runs[2][0]).all()


@pytest.mark.parametrize("make", [pictura.make_vec, DriveEnv])
def test_the_seed_of_an_environment_counts_until_a_reset_with_another(make):
    first = [make("procedural:3", observation="vector", seed=seed).reset()[0]["ego"] for seed in (5, 5, 6)]
    assert (first[0] == first[1]).all() and not (first[0] == first[2]).all()


def test_next_step_worlds_begin_in_the_step_after_their_end():
    env = vector("next_step")
    assert env.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    env.reset(seed=1)
    halted = np.zeros(24, bool)
    for step in range(25):
        _, reward, terminated, truncated, info = env.step(np.full(24, 7))
        assert not (terminated & halted).any(), "terminated is said once"
        assert (reward[halted] == 0).all()
        halted |= terminated
        assert (info["active"] == ~halted | (info["active"] & ~halted)).all()
    assert truncated[~halted & info["valid"]].all()
    seen, reward, terminated, truncated, info = env.step(np.full(24, 7))
    assert (reward == 0).all() and not terminated.any() and not truncated.any() and not info["valid"].any()
    assert info["active"].sum() > 12
    assert env.step(np.full(24, 7))[4]["valid"].sum() > 12


def test_same_step_worlds_begin_in_the_step_of_their_end():
    env = vector("same_step")
    assert env.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    env.reset(seed=1)
    for _ in range(24):
        seen, _, _, _, info = env.step(np.full(24, 7))
        assert "final_obs" not in info
    last = seen
    seen, reward, terminated, truncated, info = env.step(np.full(24, 7))
    assert truncated.sum() > 12 and (info["_final_obs"] == truncated | terminated).all()
    ended = info["_final_obs"]
    assert not (seen["waypoints"][ended] == info["final_obs"]["waypoints"][ended]).all()
    np.testing.assert_allclose(info["final_obs"]["waypoints"][ended], last["waypoints"][ended], atol=0.05)
    assert (info["final_info"]["valid"] == info["valid"]).all()
    following = env.step(np.full(24, 7))
    assert following[4]["valid"].sum() > 12 and not following[3].any()


@pytest.mark.parametrize("autoreset", ["next_step", "same_step"])
def test_statistics_equal_the_simulators_totals(autoreset):
    env = AgentStatistics(vector(autoreset, num_agents=16))
    env.reset(seed=2)
    random = np.random.default_rng(0)
    for _ in range(120):
        env.step(random.integers(0, 12, 48))
    totals = env.unwrapped.batch.simulator.totals()
    for name, value in env.statistics.items():
        if isinstance(value, int):
            assert value == totals[name], name
        else:
            assert value == pytest.approx(totals[name], rel=1e-4, abs=1e-3), name
    assert env.statistics["finished_agent_episodes"] > 50 and env.statistics["off_road"] > 0


def test_gymnasium_wrappers_accept_the_environment():
    from gymnasium.wrappers.vector import DictInfoToList, FlattenObservation, RecordEpisodeStatistics

    for autoreset in ("next_step", "same_step"):
        env = RecordEpisodeStatistics(vector(autoreset))
        env.reset(seed=1)
        total = np.zeros(24)
        for _ in range(25):
            _, reward, terminated, truncated, info = env.step(np.full(24, 7))
            total += reward
        ended = terminated | truncated
        assert ended.any()
        np.testing.assert_allclose(info["episode"]["r"][ended], total[ended], atol=1e-4)
    flat = FlattenObservation(vector("next_step"))
    seen, _ = flat.reset(seed=1)
    assert seen.ndim == 2 and len(seen) == 24
    listed = DictInfoToList(vector("next_step"))
    listed.reset(seed=1)
    assert len(listed.step(np.full(24, 7))[4]) == 24


def test_the_vector_form_is_registered():
    env = gymnasium.make_vec("pictura/Drive-v0", num_envs=12, vectorization_mode="vector_entry_point", num_agents=4)
    assert env.num_envs == 12 and env.unwrapped.batch.num_worlds == 3
    forked = gymnasium.make_vec("pictura/Drive-v0", num_envs=2, vectorization_mode="async", num_agents=3)
    forked.reset(seed=1)
    forked.step(np.array([7, 7]))
    forked.close()


def test_presets_equal_worlds_of_the_configurations():
    envs = pictura.make_vec(preset="demo", seed=1)
    simulator = envs.batch.simulator
    assert [town.name for town in simulator.maps] == ["procedural:0"] and simulator.episode_steps == 600
    assert envs.num_envs == 32 and all(4 <= agents <= 8 for _, agents, _ in simulator.worlds[:-1])
    seen, _ = envs.reset(seed=1)
    assert seen["rgb"].shape == (32, 4, 3, 18, 32) and "lanes" not in seen
    told = dict(zip(pictura.CONDITIONING_NAMES, simulator.state["conditioning"].numpy().T))
    assert (told["velocity"] == 0.5).all() and (told["steer"] == 0.5).all() and (told["timestep"] == np.float32(2.5e-5)).all()
    # Arguments count instead of the preset's.
    own = pictura.make_vec("procedural:3", 5, preset="demo", num_worlds=2, observation="vector", conditioning={"collision": 2}, episode_steps=50)
    told = dict(zip(pictura.CONDITIONING_NAMES, own.batch.simulator.state["conditioning"].numpy().T))
    assert (told["collision"] == 2).all() and (told["velocity"] == 0.5).all()
    assert own.num_envs == 10 and own.batch.simulator.episode_steps == 50 and "lanes" in own.reset(seed=1)[0]


@pytest.mark.parametrize("preset", ["town", "paper"])
def test_presets_of_whole_towns_accept_other_maps(preset):
    envs = pictura.make_vec(["procedural:1", "procedural:2"], preset=preset, num_envs=40, seed=3)
    seen, _ = envs.reset(seed=1)
    size = {"town": (18, 32), "paper": (54, 96)}[preset]
    assert seen["rgb"].shape == (40, 4, 3, *size) and len(envs.batch.simulator.maps) <= 2
    assert envs.batch.simulator.episode_steps == {"town": 3000, "paper": 1280}[preset]


def test_ranges_of_presets_are_expanded():
    from pictura.presets import preset_options

    options = preset_options("town", num_agents=4, num_worlds=1)
    assert options["maps"][0] == "Town01" and options["maps"][-12:] == [f"procedural:{seed}" for seed in range(1000, 1012)]


def test_errors_name_wrong_options():
    for options, name in (
        ({"observation": "smells"}, "observation"),
        ({"actions": "continuous"}, "actions"),
        ({"autoreset": "never"}, "autoreset"),
        ({"array": "jax"}, "array"),
        ({"num_envs": 7, "num_agents": 4}, "num_envs"),
        ({"maps": []}, "maps"),
        ({"maps": 3}, "maps"),
        ({"preset": "cars"}, "preset: expected one of demo, town, paper; got 'cars'"),
    ):
        with pytest.raises(pictura.UsageError, match=name):
            pictura.make_vec(**({"maps": "procedural:3"} | options))
    for options, said in (
        ({"num_agent": 3}, "num_agent: no such option: did you mean num_agents?"),
        ({"wals": True}, "wals: no such option: did you mean walls?"),
        ({"autorest": "same_step"}, "autorest: no such option: did you mean autoreset?"),
        ({"colour": 3}, "colour: no such option$"),
    ):
        with pytest.raises(pictura.UsageError, match=said.replace("?", "[?]")):
            pictura.make_vec("procedural:3", **options)
    env = vector()
    with pytest.raises(gymnasium.error.ResetNeeded, match="reset"):
        env.step(np.full(24, 7))
    env.reset(seed=1)
    for wrong in (np.zeros(24), np.zeros(23, int), np.full(24, 12)):
        with pytest.raises(pictura.Error):
            env.step(wrong)
    pairs = vector(actions="multi_discrete")
    pairs.reset(seed=1)
    with pytest.raises(pictura.Error, match="longitudinal"):
        pairs.step(np.full((24, 2), 3))


@pytest.mark.parametrize("array", ["numpy", "torch"])
def test_wrong_actions_are_refused_without_wrapping(array):
    if array == "torch":
        pytest.importorskip("torch")
    env = vector(array=array)
    env.reset(seed=1)
    wrong = [np.full(24, 2**40), np.full(24, 2**32 + 3), np.full(24, -(2**32)), np.full(24, -1), np.full(24, 12), np.full(24, np.nan)]
    for actions in [*wrong, np.full(24, 2**64 - 1, np.uint64), np.ones(24, bool), np.ones(23, int), [7], None, "go"]:
        with pytest.raises((pictura.Error, TypeError)):
            env.step(actions)
    env.step([7] * 24)
    env.step(np.full(24, 7, np.uint8))
    env = vector(array=array, actions="multi_discrete")
    env.reset(seed=1)
    for pair in ([-1, 0], [0, 3], [1, -1], [4, 0], [2**33, 0], [0, 2**62]):
        with pytest.raises(pictura.Error):
            env.step(np.tile(pair, (24, 1)))
    env.step(np.tile([3, 2], (24, 1)))


def test_uncopied_observations_share_the_simulators_memory():
    env = vector(copy=False)
    seen, _ = env.reset(seed=1)
    assert seen["ego"].ctypes.data == env.batch.simulator.observations["ego"].numpy().ctypes.data


def test_pettingzoo_passes_its_tests():
    pytest.importorskip("pettingzoo")
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    from pictura.envs.pettingzoo_env import DriveParallelEnv

    make = lambda: DriveParallelEnv(num_agents=5, episode_steps=40)  # noqa: E731
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        parallel_api_test(make(), num_cycles=150)
        parallel_seed_test(make)
    env = make()
    seen, infos = env.reset(seed=1)
    assert set(seen) == set(infos) == set(env.agents)
    while env.agents:
        acting = list(env.agents)
        *_, terminations, truncations, infos = env.step({agent: 11 for agent in acting})
        assert set(terminations) == set(acting)
        assert all(infos[agent]["active"] for agent in env.agents)
    env.reset(seed=1)
    with pytest.raises(pictura.Error, match="agent_"):
        env.step({})
    for action in (7.9, 12):
        with pytest.raises(pictura.Error, match=rf"{env.agents[0]}: expected an action of Discrete\(12\), got {action}"):
            env.step(dict.fromkeys(env.agents, action))


STREET = """<OpenDRIVE><header revMajor="1" revMinor="6"/><road id="1" junction="-1" length="60"><link/>
<planView><geometry s="0" x="0" y="0" hdg="0" length="60"><line/></geometry></planView><lanes><laneSection s="0">
<center><lane id="0" type="none"/></center><right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


def test_entering_agents_get_new_names():
    pytest.importorskip("pettingzoo")
    from pictura.envs.pettingzoo_env import DriveParallelEnv

    street = pictura.Map.from_text(STREET)
    env = DriveParallelEnv(street, 2, pedestrian_fraction=0, cyclist_fraction=0, parked_cars=0, episode_steps=400)
    env.reset(seed=2)
    known, left = set(env.agents), set()
    for _ in range(300):
        speed = env.batch.simulator.state["speed_mps"].numpy()
        acting = list(env.agents)
        actions = {agent: 10 if speed[env._slot(agent)] < 4 else 7 for agent in acting}
        seen, _, terminations, truncations, infos = env.step(actions)
        entered = set(env.agents) - set(acting)
        assert not entered & known and set(seen) == set(infos) == set(truncations) == set(acting) | entered
        assert all(env.observation_space(agent).contains(seen[agent]) for agent in entered)
        known |= entered
        left |= {agent for agent in acting if truncations[agent]}
    assert "agent_0_1" in known and "agent_0" in left
    report = env.batch.simulator.spawn_report()
    assert report["left"] == len(left) and report["entered"] == len([agent for agent in known if agent.count("_") == 2])


def drive_on(speed):
    return np.where(speed < 4, 10, 7)


def test_same_step_has_the_last_observation_of_leaving_agents():
    env = pictura.make_vec(
        pictura.Map.from_text(STREET), 2, pedestrian_fraction=0, cyclist_fraction=0, parked_cars=0, autoreset="same_step"
    )
    env.reset(seed=2)
    for _ in range(300):
        seen, _, terminated, truncated, info = env.step(drive_on(env.batch.simulator.state["speed_mps"].numpy()))
        ended = terminated | truncated
        assert ("final_obs" in info) == ended.any()
        if truncated.any():
            assert (info["_final_obs"] == ended).all() and not info["active"][truncated].any()
            assert (info["final_obs"]["ego"][truncated] == seen["ego"][truncated]).all()
            return
    pytest.fail("nobody left the street")


def test_torchrl_marks_leaving_agents():
    pytest.importorskip("torchrl")
    import torch

    from pictura.envs.torchrl_env import DriveTorchRLEnv

    street = pictura.Map.from_text(STREET)
    env = DriveTorchRLEnv(street, num_agents=2, num_worlds=1, pedestrian_fraction=0, cyclist_fraction=0, parked_cars=0)
    state = env.reset()
    for _ in range(300):
        action = drive_on(env.batch.simulator.state["speed_mps"].numpy())
        state["agents", "action"] = torch.from_numpy(action).reshape(1, 2)
        state = env.step(state)["next"]
        if state["agents", "truncated"].any():
            assert not state["done"].any() and not state["agents", "terminated"].any()
            return
    pytest.fail("nobody left the street")


def test_torchrl_passes_its_check():
    pytest.importorskip("torchrl")
    import torch
    from torchrl.envs.utils import check_env_specs

    from pictura.envs.torchrl_env import DriveTorchRLEnv

    for options in ({}, {"observation": "flat", "actions": "multi_discrete"}, {"observation": "images", **SMALL}):
        env = DriveTorchRLEnv(num_agents=4, num_worlds=3, episode_steps=20, num_threads=1, **options)
        check_env_specs(env)
    rollout = env.rollout(50, break_when_any_done=False)
    assert rollout.batch_size == torch.Size([3, 50])
    assert rollout["next", "done"].sum() >= 3 and rollout["agents", "mask"].any()


def test_pufferlib_interface():
    from pictura.envs.puffer_env import DrivePufferEnv

    env = DrivePufferEnv(num_agents=6, num_worlds=2, episode_steps=20, num_threads=1)
    assert env.single_observation_space.shape == env.observations.shape[1:] and env.num_agents == 12
    seen, infos = env.reset(seed=1)
    buffers = [env.observations, env.rewards, env.terminals, env.truncations]
    logs = []
    for step in range(45):
        seen, rewards, terminals, truncations, infos = env.step(np.full(12, step % 12, np.int32))
        assert all(a is b for a, b in zip((seen, rewards, terminals, truncations), buffers))
        assert (env.masks == env.batch.active).all()
        logs += infos
    for wrong in (np.full(12, 3.7), np.full(12, 12), np.zeros(11, int), None):
        with pytest.raises(pictura.Error):
            env.step(wrong)
    assert sum(log["n"] for log in logs) == env.batch.simulator.totals()["finished_agent_episodes"] > 0
    assert not env.done
    of_seed = {}
    for seed in (0, 1):
        other = DrivePufferEnv(num_agents=6, num_worlds=1, seed=seed, num_threads=1)
        of_seed[seed] = other.reset()[0].copy()
    assert (of_seed[0] != of_seed[1]).any(), "without a seed the environment's own"
