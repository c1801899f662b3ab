"""
Training, evaluation and saved policies, with torch. Use them as names of `pictura`.
"""
from __future__ import annotations
import collections.abc
import pictura._pictura
import typing
__all__: list[str] = ['PolicySession', 'evaluate', 'evaluate_robust', 'evaluate_scenes', 'probe_corner', 'probe_pedestrian', 'probe_removal', 'train']
class PolicySession:
    """
    Saved policy: evaluates scenes and observations, and holds the world and cameras of its training. One thread at a time, also for
    renderers that are passed to it.
    
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
        checkpoint: a .ckpt file. num_threads: 0 for all. device: 'auto', 'cpu' or 'cuda', the policy's device; simulators, renderers
        and arrays passed to it use the same device. The others as in pictura.evaluate(). Raises pictura.Error naming the file, or
        pictura.UsageError if the policy cannot use these cameras.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def evaluate(self, observations: dict, *, scene: pictura._pictura.Scene = None, views: typing.Any = None, renderer: typing.Any = None, is_drawn: typing.Any = None) -> tuple:
        """
        Returns logits float32 [batch, 12] and values float32 [batch], on its device.
        
        observations: arrays [batch, ...] by name, like pictura.Simulator.observations. A policy that reads images also needs scene,
        views [batch] and a renderer from make_renderer(); is_drawn: uint8 [batch], 0 where its images are black. Raises pictura.Error
        naming what is missing or does not fit.
        """
    def evaluation_world(self, steps: typing.SupportsInt | typing.SupportsIndex) -> dict:
        """
        Returns the options of the paper's evaluation world: episodes of `steps` steps, fixed conditioning and lights.
        """
    def make_controller(self, simulator: typing.Any, renderer: typing.Any = None, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> typing.Any:
        """
        Returns a pictura.Controller that drives in this simulator, which must use the session's device: with the most likely action, or
        draws keyed by seed, world, agent, episode and step as in training. renderer: for a policy that reads images, from
        make_renderer(), with the simulator's geometries. Raises pictura.Error if a geometry or the renderer is missing.
        """
    def make_renderer(self) -> typing.Any:
        """
        Returns a pictura.Renderer of its images, to which the maps must be uploaded; None if the policy reads no images.
        """
    def training_world(self) -> dict:
        """
        Returns the options with which pictura.Simulator(maps, worlds, **options) creates the world of its training.
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
    Runs the paper's evaluation, like `pictura evaluate`, in worlds that no training has.
    
    checkpoint: a policy's; '' with a controller in the paper's world. maps: names, files or ranges such as procedural:1-64.
    controller: 'lane', 'idm_lanes', 'random' or 'idle', which drives instead, or a function(observations) of NumPy arrays [slots,
    ...] by name, like pictura.Simulator.observations, that returns actions int [slots], or logits [slots, 12] and values [slots], on
    the CPU. A function gets images, too, if cameras are named (rig, or width_px and height_px): `rgb` uint8 [slots, cameras, 3, height,
    width], black for inactive agents; rgb_0, rgb_1, ... if cameras have several sizes. densities: 'light', 'medium' and 'dense', with 60, 120 and 150 agents per world, or with agents_per_world. device, simulator, renderer: 'auto' or names;
    renderer '': as in training. rig, or width_px and height_px: other cameras. backbone: path of the program of policy.backbone.
    conditioning: numbers by name. light_cycles: 'phases' or 'independent', light_heads: 'as_mapped' or 'visible'; '': as in
    training. average: uses the average of weights in the checkpoint. camera_severity: severity of randomized cameras, 0 to 2
    (docs/explanation/cameras.md). decision_steps: steps for which an action is held; 0: as in training. others: other drivers, such
    as {'lane': 0.3, 'other.safetensors': 0.2}: policies or controllers, and their shares of vehicles; 'blind', 'phantom_braking'
    and 'inattentive': shares of agents that the policy drives while impaired. on_progress: called with the completed fraction and
    the remaining seconds, from a separate thread.
    Returns a dict: rows, one per density and driver (None: the evaluated driver), with its counts, and each metric as (value, half
    of its 95 % interval); seconds, agent_steps, policy_hash, light_cycles, others. ^C raises KeyboardInterrupt. Raises
    pictura.Error naming file and key of bad input.
    
    Examples:
        >>> options = {'scenarios': 1, 'steps': 20, 'agents_per_world': 8}
        >>> rows = pictura.evaluate('models/perspective.safetensors', ['procedural:1'], **options)['rows']
        >>> sorted(rows[0])[:3]                         # doctest: +SKIP
        ['agents_per_world', 'at_fault_collision_rate', 'camera_severity']
        >>> lane_keeper = pictura.evaluate('', ['procedural:1'], controller='lane', **options)
    """
def evaluate_robust(checkpoint: str, *, controller: str | collections.abc.Callable = '', scenarios: typing.SupportsInt | typing.SupportsIndex = 24, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, on_progress: typing.Any = None) -> dict:
    """
    Runs the robust protocol, like `pictura evaluate --protocol robust`: a fixed set of generated towns, other drivers and
    randomized cameras (docs/how-to/robust_benchmark.md).
    
    checkpoint: a policy's; '' with a controller: a name or a function, as for evaluate(). A function gets images if cameras are named
    (rig, or width_px and height_px). scenarios: scenarios per condition; other numbers than the default give a trial. All other
    arguments are those of evaluate(); seed, conditioning and camera_severity are fixed.
    Returns a dict: rows, one per condition, with part, name, not_driven (the reason if the condition does not apply, else None),
    counts, and each metric as (value, half of its 95 % interval); pooled: the same over the conditions of 'towns', 'others', 'cameras'
    and 'all'; seconds, agent_steps, policy_hash. ^C raises KeyboardInterrupt.
    
    Examples:
        >>> report = pictura.evaluate_robust('models/perspective.safetensors', scenarios=2)  # doctest: +SKIP
        >>> report['pooled']['towns']['km_per_infraction']                                   # doctest: +SKIP
        (0.8, 0.2)
    """
def evaluate_scenes(checkpoint: str, scenes: collections.abc.Sequence[str], *, protocol: str = 'womd', controller: str | collections.abc.Callable = '', control: str | None = None, start_step: typing.SupportsInt | typing.SupportsIndex | None = None, steps: typing.SupportsInt | typing.SupportsIndex | None = None, densities: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] | None = None, rules: dict = {}, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, num_scenes: typing.SupportsInt | typing.SupportsIndex = 0, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, rollouts: str = '', realism: str = '', on_progress: typing.Any = None) -> dict:
    """
    Runs the paper's zero-shot evaluation in recorded scenes, like `pictura evaluate --protocol`.
    
    checkpoint: a policy's; '' with a controller: 'log', 'inverse', 'idm', 'idm_lanes', 'random' or 'idle', which drives instead.
    scenes: files, folders, 'FILE#K'. protocol: 'womd', 'gpudrive', 'pufferdrive2', 'pufferdrive3', 'waymax' or 'simagents';
    control, start_step, steps, densities (shares of road users that remain) and rules (values by name,
    docs/explanation/evaluation.md) replace the protocol's settings. first_scene, num_scenes: range of the scenes; 0: all from the
    first on. rollouts: file of the rollouts, with the protocol 'simagents', in the format of the Waymo sim-agents challenge. realism:
    '2024' or '2025' scores these rollouts (docs/explanation/realism.md), with or without a file. The others as in evaluate().
    Returns a dict: rows, one per density, with each metric as (value, half of its 95 % interval); agents, one for every driven road
    user of a scene, density and rollout; realism, if asked for, as pictura.realism.score_file() returns it; scenes, scored,
    without_drivers, faults (skipped scenes, with reasons); seconds, agent_steps, policy_hash. ^C raises KeyboardInterrupt. Raises pictura.Error if no scene can be used.
    
    Examples:
        >>> results = pictura.evaluate_scenes('models/vector.safetensors', ['validation'])   # doctest: +SKIP
        >>> results['scored'], len(results['faults'])                                        # doctest: +SKIP
        (100, 0)
    """
def probe_corner(policies: collections.abc.Sequence[str | collections.abc.Callable], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 5, batch: typing.SupportsInt | typing.SupportsIndex = 256, pairs: typing.SupportsInt | typing.SupportsIndex = 200, max_distance_m: typing.SupportsFloat | typing.SupportsIndex = 25.0, min_speed_mps: typing.SupportsFloat | typing.SupportsIndex = 2.0, user_range_m: typing.SupportsFloat | typing.SupportsIndex = 50.0, driver: str = '', control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    Measures how policies approach blind corners with a hidden vehicle, and similar empty corners, like `pictura probe corner`.
    
    policies, maps, density, agents_per_world, scenes, steps, sample_steps and the arguments after argmax: as in probe_removal().
    pairs: total number. max_distance_m: maximum distance before the corner at which a policy takes over. min_speed_mps: minimum
    speed of the ego then, and of the hidden vehicle. user_range_m: maximum distance of the hidden vehicle before the junction.
    driver: 'lane' drives the scenes instead of the policies. control: 'none', 'permuted' or 'untrained'. batch: pairs that run at
    once. cases_file: a CSV file for every run. replay, case, cameras: as in probe_removal(); a case is a pair, by default that of
    the example's figure.
    Returns a dict, that of the command's summary.json (docs/explanation/probes.md). ^C raises KeyboardInterrupt. Raises
    pictura.Error naming file and key of bad input.
    
    Examples:
        >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
        >>> pictura.probe_corner(policies, maps, pairs=20, cases_file='pairs.csv')           # doctest: +SKIP
    """
def probe_pedestrian(policies: collections.abc.Sequence[str | collections.abc.Callable], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 10, batch: typing.SupportsInt | typing.SupportsIndex = 4096, paths: typing.SupportsInt | typing.SupportsIndex = 32, hider_range_m: typing.SupportsFloat | typing.SupportsIndex = 30.0, min_speed_mps: typing.SupportsFloat | typing.SupportsIndex = 1.0, height_m: typing.SupportsFloat | typing.SupportsIndex = 1.2000000476837158, control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    Measures how policies' value and braking change as a pedestrian emerges from behind a vehicle and is hidden again, like `pictura
    probe pedestrian`.
    
    policies, maps, density, agents_per_world, scenes, steps, sample_steps, batch and the arguments after argmax: as in
    probe_removal(). paths: total number, each through one state. hider_range_m: maximum distance of the vehicle behind which a path
    begins. min_speed_mps: minimum speed of the ego, forwards. height_m: height of the pedestrian. control: 'none', 'nobody' or
    'untrained'. cases_file: a CSV file for every point of every path. replay, case, cameras: as in probe_removal().
    Returns a dict, that of the command's summary.json (docs/explanation/probes.md). ^C raises KeyboardInterrupt. Raises
    pictura.Error naming file and key of bad input.
    
    Examples:
        >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
        >>> pictura.probe_pedestrian(policies, maps, paths=8, cases_file='paths.csv')        # doctest: +SKIP
    """
def probe_removal(policies: collections.abc.Sequence[str | collections.abc.Callable], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 10, batch: typing.SupportsInt | typing.SupportsIndex = 4096, removals: typing.SupportsInt | typing.SupportsIndex = 88000, range_m: typing.SupportsFloat | typing.SupportsIndex = 50.0, control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    Measures how policies' value and braking change when one road user is removed, like `pictura probe removal`.
    
    policies: checkpoints, safetensors, or functions as in evaluate(), on the CPU; the world is the first policy's, a function's is the
    paper's. A function that returns actions brakes with probability 0 or 1 and has no values (None); replay and 'untrained' need
    saved policies. maps, density, agents_per_world, steps and the arguments
    after argmax: as in evaluate(). scenes: number of driven scenarios, an equal share by each policy; 0: equally many on each map
    for each policy, two per map or more. removals: total number. sample_steps: steps between states. range_m: maximum distance of a
    user. control: 'none', 'nobody', 'permuted' or 'untrained'. batch: cases in a call. cases_file: a CSV file for every case.
    replay: a page *.html that plays the scene of one case and shows its images with and without the road user
    (docs/reference/replay.md); case: its number in cases_file, by default the case with the largest change in the first policy's
    value; cameras: keeps the ego's images of every step.
    Returns a dict, that of the command's summary.json (docs/explanation/probes.md). ^C raises KeyboardInterrupt. Raises
    pictura.Error naming file and key of bad input.
    
    Examples:
        >>> policies, maps = ['models/perspective.safetensors'], ['procedural:1']
        >>> pictura.probe_removal(policies, maps, removals=200, cases_file='cases.csv')      # doctest: +SKIP
    """
def train(config: str, out: str, *, overrides: collections.abc.Sequence[str] = [], old_run: str = 'refuse', init_from: str = '', minutes: typing.SupportsFloat | typing.SupportsIndex = 0.0, on_progress: typing.Any = None, on_notice: typing.Any = None) -> dict:
    """
    Trains by self-play like `pictura train`, and writes the same files into the folder `out`.
    
    config: a TOML file (docs/reference/configuration.md). overrides: for instance 'train.updates=2'. old_run: treatment of an
    existing run in `out`, 'refuse', 'resume' or 'overwrite'. init_from: a checkpoint with the initial weights. minutes: wall-time
    limit; 0: none. on_progress: called after every update with a dict: update, updates, agent_steps, agent_steps_per_s,
    episode_return, eta_s, scalars (those of progress.csv). on_notice: called with a text. Both are called from training's own
    thread, and their exceptions end training.
    Returns a dict: agent_steps, updates, agent_steps_per_s, episode_return, km_driven, checkpoint, policy_hash and more. ^C ends
    training after the present update, saves, and raises KeyboardInterrupt. Raises pictura.Error naming file and key of bad input.
    
    Examples:
        >>> report = pictura.train('configs/smoke.toml', 'runs/mine', old_run='overwrite')
        >>> report['updates']
        4
    """
