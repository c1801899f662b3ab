"""
Training, evaluation and saved policies, with torch. Import these names from `pictura`.
"""
from __future__ import annotations
import collections.abc
import pictura._pictura
import typing
__all__: list[str] = ['PolicySession', 'evaluate', 'evaluate_robust', 'evaluate_scenes', 'probe_corner', 'probe_pedestrian', 'probe_removal', 'train']
class PolicySession:
    """
    Saved policy, with the world and cameras of its training. It computes actions from observations and images. Only one
    thread at a time may use a session and the renderers that are passed to it.
    
    Examples:
        >>> session = pictura.PolicySession('models/perspective.safetensors')
        >>> town = pictura.Map.load('procedural:3')
        >>> simulator = pictura.Simulator([town], [(0, 8)], **session.training_world())
        >>> renderer = session.make_renderer()          # None for a policy of lists
        >>> for handle, geometry in simulator.geometries.items():
        ...     renderer.upload(handle, geometry)
        >>> simulator.run(session.make_controller(simulator, renderer), steps=20)
        >>> simulator.totals()['distance_m'] > 0
        True
    """
    def __init__(self, checkpoint: str, *, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '') -> None:
        """
        checkpoint: checkpoint or safetensors file.
        device: 'auto', 'cpu' or 'cuda', the device of the policy. Simulators, renderers and arrays that are passed to the
        session must be on this device.
        The other arguments are those of pictura.evaluate().
        Raises pictura.Error, which names the file, and pictura.UsageError if the policy cannot use the given cameras.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def evaluate(self, observations: dict, *, scene: pictura._pictura.Scene = None, views: typing.Any = None, renderer: typing.Any = None, is_drawn: typing.Any = None) -> tuple:
        """
        Returns logits float32 [batch, 12] and values float32 [batch], on the session's device.
        
        observations: dict of arrays [batch, ...], like pictura.Simulator.observations.
        scene, views, renderer: needed by policies that read images. views is [batch], and the renderer is from make_renderer().
        is_drawn: uint8 [batch], 0 where images are black instead of drawn; default: all images are drawn.
        Raises pictura.Error, which names a missing or invalid argument.
        """
    def evaluation_world(self, steps: typing.SupportsInt | typing.SupportsIndex) -> dict:
        """
        Returns the options of the paper's evaluation world: episodes of `steps` steps, fixed conditioning and lights.
        """
    def make_controller(self, simulator: typing.Any, renderer: typing.Any = None, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> typing.Any:
        """
        Returns a pictura.Controller that drives agents of a simulator with the policy.
        
        simulator: a simulator on the session's device.
        renderer: needed by policies that read images: a renderer from make_renderer(), with the simulator's geometries.
        argmax: whether to take the most likely action. Otherwise actions are sampled as in training, with random numbers keyed
        by seed, world, agent, episode and step.
        Raises pictura.Error if the renderer or one of its geometries is missing.
        """
    def make_renderer(self) -> typing.Any:
        """
        Returns a pictura.Renderer for the policy's images; None if the policy reads no images. Upload the geometries of the maps to the renderer before its first use.
        """
    def training_world(self) -> dict:
        """
        Returns the options with which pictura.Simulator(maps, worlds, **options) creates worlds like those of the training.
        """
    @property
    def device(self) -> str:
        ...
    @property
    def reads_images(self) -> bool:
        ...
    @property
    def rig(self) -> pictura._pictura.Rig:
        ...
def evaluate(checkpoint: str, maps: collections.abc.Sequence[str], *, controller: str | collections.abc.Callable = '', densities: collections.abc.Sequence[str] = ['light', 'medium', 'dense'], agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, others: dict = {}, first_scenario: typing.SupportsInt | typing.SupportsIndex = 0, scenarios: typing.SupportsInt | typing.SupportsIndex = 200, steps: typing.SupportsInt | typing.SupportsIndex = 3000, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', on_progress: typing.Any = None) -> dict:
    """
    Runs the paper's evaluation, like `pictura evaluate`, in worlds that are not used for training.
    
    Returns a dict. `rows` has one dict for each density and driver (None: the evaluated driver), with counts, and metrics
    as (value, half width of the 95 % interval). The other names are seconds, agent_steps, policy_hash, light_cycles, others
    and camera_severity.
    
    Args:
        checkpoint: File of a policy; '' with `controller`, which then drives in the paper's world.
        maps: Names, files, or ranges such as procedural:1-64.
        controller: Driver instead of the policy: 'lane', 'idm_lanes', 'random', 'idle', or a function. The function gets a
            dict of NumPy arrays [slots, ...] like pictura.Simulator.observations, and returns actions int [slots], or
            logits [slots, 12] and values [slots], on the CPU. If cameras are given (rig, or width_px and height_px), the
            dict also contains images: `rgb` uint8 [slots, cameras, 3, height, width], black for inactive agents, or rgb_0,
            rgb_1, ... for cameras of several sizes.
        densities: 'light', 'medium' and 'dense': 60, 120 and 150 agents per world.
        agents_per_world: Number of agents per world instead of the densities' numbers; 0: as in `densities`.
        others: Other drivers with their shares of vehicles, policy files or controllers, such as {'lane': 0.3,
            'other.safetensors': 0.2}. 'blind', 'phantom_braking' and 'inattentive': shares of agents that the policy drives
            while impaired.
        first_scenario: Index of the first scenario.
        scenarios: Number of scenarios per density. A scenario is one seeded world.
        steps: Steps of 0.1 s per scenario.
        argmax: Whether the policy takes its most likely action; otherwise actions are sampled.
        seed: Seed of the scenarios.
        num_threads: Number of CPU threads; 0: all.
        device: Device of the policy, 'auto', 'cpu' or 'cuda'.
        simulator: Executor of the simulator, or 'auto'.
        renderer: Name of a renderer, or 'auto'; '': as in training.
        samples: Samples per pixel of the renderer 'gl': '4' (MSAA) or '4x4' (supersampling).
        rig: File of a rig instead of the cameras of the training.
        width_px: Image width of the paper's rig; 0: as in training.
        height_px: Image height of the paper's rig; 0: as in training.
        backbone: Path of the program in policy.backbone, if it has moved since training.
        conditioning: Dict of numbers that replace values of the configuration's [evaluate.conditioning].
        average: Whether to use the average of weights in the checkpoint.
        decision_steps: Steps for which each action is held; 0: as in training.
        camera_severity: Severity of randomized cameras, 0 to 2 (docs/explanation/cameras.md).
        light_cycles: 'phases' or 'independent'; '': as in training.
        light_heads: 'as_mapped' or 'visible'; '': as in training.
        on_progress: Function that is called with the completed fraction and the remaining seconds, from a separate thread.
    
    Raises:
        KeyboardInterrupt: The user pressed ^C.
        pictura.Error: An input is invalid; the message names file and key.
    
    Examples:
        >>> options = {'scenarios': 1, 'steps': 20, 'agents_per_world': 8}
        >>> rows = pictura.evaluate('models/perspective.safetensors', ['procedural:1'], **options)['rows']
        >>> sorted(rows[0])[:3]
        ['active_at_end_share', 'asked', 'at_fault_collision_rate']
        >>> lane_keeper = pictura.evaluate('', ['procedural:1'], controller='lane', **options)
    """
def evaluate_robust(checkpoint: str, *, controller: str | collections.abc.Callable = '', scenarios: typing.SupportsInt | typing.SupportsIndex = 24, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, on_progress: typing.Any = None) -> dict:
    """
    Runs the robust protocol, like `pictura evaluate --protocol robust`: a fixed set of conditions with generated towns,
    other drivers and randomized cameras (docs/how-to/robust_benchmark.md).
    
    checkpoint: file of a policy; '' with `controller`, a name or a function as for evaluate().
    scenarios: scenarios per condition. Another number than the default gives a trial, not a result of the benchmark.
    The other arguments are those of evaluate(). The benchmark fixes seed, conditioning and camera_severity.
    
    Returns a dict. `rows` has one dict for each condition: part, name, not_driven (the reason if the condition does not
    apply, else None), counts, and metrics as (value, half width of the 95 % interval). `pooled` has the metrics over all
    conditions of 'towns', 'others', 'cameras' and 'all'. The other names are seconds, agent_steps and policy_hash. ^C
    raises KeyboardInterrupt.
    
    Examples:
        >>> report = pictura.evaluate_robust('models/perspective.safetensors', scenarios=2)  # doctest: +SKIP
        >>> report['pooled']['towns']['km_per_infraction']                                   # doctest: +SKIP
        (0.8, 0.2)
    """
def evaluate_scenes(checkpoint: str, scenes: collections.abc.Sequence[str], *, protocol: str = 'womd', controller: str | collections.abc.Callable = '', control: str | None = None, start_step: typing.SupportsInt | typing.SupportsIndex | None = None, steps: typing.SupportsInt | typing.SupportsIndex | None = None, densities: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] | None = None, rules: dict = {}, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, num_scenes: typing.SupportsInt | typing.SupportsIndex = 0, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, rollouts: str = '', realism: str = '', on_progress: typing.Any = None) -> dict:
    """
    Runs the paper's zero-shot evaluation in recorded scenes, like `pictura evaluate --protocol`.
    
    Returns a dict. `rows` has one dict for each density, with metrics as (value, half width of the 95 % interval). `agents`
    has one dict for each driven road user in each scene, density and rollout. `realism`, if requested, is the result of
    pictura.realism.score_file(). The other names are scenes, scored, without_drivers, repaired_headings (by the
    rule max_first_turn_deg), faults (skipped scenes with reasons), seconds, agent_steps and policy_hash.
    
    checkpoint: file of a policy; '' with `controller`.
    scenes: files, folders, or 'FILE#K' for scene K of a file.
    protocol: 'womd', 'gpudrive', 'pufferdrive2', 'pufferdrive3', 'waymax' or 'simagents'.
    controller: driver instead of the policy: 'log', 'inverse', 'idm', 'idm_lanes', 'random', 'idle', or a function as in
    evaluate().
    control, start_step, steps, densities (shares of road users that remain), rules (dict of values): settings that replace
    those of the protocol (docs/explanation/evaluation.md).
    first_scene, num_scenes: range of scenes; num_scenes 0: all from the first on.
    rollouts: file for the rollouts of the protocol 'simagents', in the format of the Waymo sim-agents challenge.
    realism: '2024' or '2025', the version of the realism score of these rollouts (docs/explanation/realism.md). It needs no
    rollouts file.
    The other arguments are those of evaluate().
    
    ^C raises KeyboardInterrupt. Raises pictura.Error if no scene can be used.
    
    Examples:
        >>> results = pictura.evaluate_scenes('models/vector.safetensors', ['validation'])   # doctest: +SKIP
        >>> results['scored'], len(results['faults'])                                        # doctest: +SKIP
        (100, 0)
    """
def probe_corner(policies: collections.abc.Sequence[str | collections.abc.Callable], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 5, batch: typing.SupportsInt | typing.SupportsIndex = 256, pairs: typing.SupportsInt | typing.SupportsIndex = 200, max_distance_m: typing.SupportsFloat | typing.SupportsIndex = 25.0, min_speed_mps: typing.SupportsFloat | typing.SupportsIndex = 2.0, user_range_m: typing.SupportsFloat | typing.SupportsIndex = 50.0, driver: str = '', control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    Measures how policies approach blind corners with a hidden vehicle, and similar empty corners, like `pictura probe corner`.
    
    A case is a pair of runs: one at a corner that hides a vehicle, and one at a similar empty corner. Returns a dict with
    the contents of the command's summary.json (docs/explanation/probes.md).
    
    pairs: total number of pairs.
    max_distance_m: maximum distance in metres from the corner at which a policy takes over the ego.
    min_speed_mps: minimum speed of the ego at the takeover, and of the hidden vehicle.
    user_range_m: maximum distance in metres from the hidden vehicle to the junction.
    driver: 'lane' drives the scenes until the takeover, instead of the policies.
    control: control experiment: 'none', 'permuted' or 'untrained' (docs/explanation/probes.md).
    batch: number of pairs that run together.
    cases_file: CSV file to write, with one row for each run.
    case: number of the replayed pair; default: the pair in the example figure of `pictura probe corner`.
    The other arguments are those of probe_removal().
    
    ^C raises KeyboardInterrupt. Raises pictura.Error, which names file and key of an invalid input.
    
    Examples:
        >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
        >>> pictura.probe_corner(policies, maps, pairs=20, cases_file='pairs.csv')           # doctest: +SKIP
    """
def probe_pedestrian(policies: collections.abc.Sequence[str | collections.abc.Callable], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 10, batch: typing.SupportsInt | typing.SupportsIndex = 4096, paths: typing.SupportsInt | typing.SupportsIndex = 32, hider_range_m: typing.SupportsFloat | typing.SupportsIndex = 30.0, min_speed_mps: typing.SupportsFloat | typing.SupportsIndex = 1.0, height_m: typing.SupportsFloat | typing.SupportsIndex = 1.2000000476837158, control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    Measures how policies' value and braking change as a pedestrian emerges from behind a vehicle and is hidden again, like `pictura
    probe pedestrian`.
    
    The pedestrian is placed at points along a path in one fixed state. The path begins behind a vehicle, which hides the
    pedestrian from the ego. Returns a dict with the contents of the command's summary.json (docs/explanation/probes.md).
    
    paths: total number of paths, each in one state.
    hider_range_m: maximum distance in metres of the vehicle behind which a path begins.
    min_speed_mps: minimum forward speed of the ego.
    height_m: height of the pedestrian.
    control: control experiment: 'none', 'unchanged' or 'untrained' (docs/explanation/probes.md).
    cases_file: CSV file to write, with one row for each point of each path.
    The other arguments are those of probe_removal().
    
    ^C raises KeyboardInterrupt. Raises pictura.Error, which names file and key of an invalid input.
    
    Examples:
        >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
        >>> pictura.probe_pedestrian(policies, maps, paths=8, cases_file='paths.csv')        # doctest: +SKIP
    """
def probe_removal(policies: collections.abc.Sequence[str | collections.abc.Callable], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 10, batch: typing.SupportsInt | typing.SupportsIndex = 4096, removals: typing.SupportsInt | typing.SupportsIndex = 88000, range_m: typing.SupportsFloat | typing.SupportsIndex = 50.0, control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    Measures how policies' value and braking change when one road user is removed, like `pictura probe removal`.
    
    A case is one removal of a road user (the user) for one observing agent (the ego) in one state. Returns a dict with the
    contents of the command's summary.json (docs/explanation/probes.md).
    
    policies: checkpoints, safetensors, or functions as in evaluate(), on the CPU. The world is that of the first policy's
    training, or the paper's world if the first policy is a function. A function that returns actions brakes with probability
    0 or 1 and has no values (None). `replay` and the control 'untrained' need saved policies.
    scenes: number of driven scenarios, which are divided equally among the policies. 0: the same number for each map and
    policy, at least two per map.
    sample_steps: steps between sampled states.
    batch: number of cases that are computed together.
    removals: total number of cases.
    range_m: maximum distance of a user in metres.
    control: control experiment: 'none', 'unchanged', 'permuted' or 'untrained' (docs/explanation/probes.md).
    cases_file: CSV file to write, with one row for each case.
    replay: page *.html to write, which plays the scene of one case and shows its images with and without the user
    (docs/reference/replay.md).
    case: number of the replayed case in cases_file; default: the case with the largest change in the first policy's value.
    cameras: whether the replay contains the ego's images of every step.
    The other arguments are those of evaluate().
    
    ^C raises KeyboardInterrupt. Raises pictura.Error, which names file and key of an invalid input.
    
    Examples:
        >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
        >>> pictura.probe_removal(policies, maps, removals=200, cases_file='cases.csv')      # doctest: +SKIP
    """
def train(config: str, out: str, *, overrides: collections.abc.Sequence[str] = [], old_run: str = 'refuse', init_from: str = '', minutes: typing.SupportsFloat | typing.SupportsIndex = 0.0, on_progress: typing.Any = None, on_notice: typing.Any = None) -> dict:
    """
    Trains a policy by self-play, like `pictura train`, and writes the same files into the folder `out`.
    
    Returns a dict: agent_steps, updates, agent_steps_per_s, episode_return, km_driven, checkpoint, policy_hash and more. ^C
    ends training after the current update, saves a checkpoint, and raises KeyboardInterrupt.
    
    Args:
        config: A TOML file (docs/reference/configuration.md).
        out: Folder for the run's files.
        overrides: Values that replace those in the file, such as 'train.updates=2'.
        old_run: What happens to an existing run in `out`: 'refuse', 'resume' or 'overwrite'.
        init_from: A checkpoint whose weights are the initial weights.
        minutes: Limit of the duration in minutes; 0: none.
        on_progress: Function that is called after every update with a dict: update, updates, agent_steps,
            agent_steps_per_s, episode_return, eta_s, and scalars (the columns of progress.csv).
        on_notice: Function that is called with the text of a notice. Both functions are called from the training's own
            thread; their exceptions end the training.
    
    Raises:
        pictura.Error: An input is invalid; the message names file and key.
    
    Examples:
        >>> report = pictura.train('configs/smoke.toml', 'runs/mine', old_run='overwrite')
        >>> report['updates']
        4
    """
