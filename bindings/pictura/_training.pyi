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
    A saved policy: what it makes of scenes and observations, and the world and cameras that it was trained with. One thread at a
    time, also for a renderer that it is given.
    """
    def __init__(self, checkpoint: str, *, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '') -> None:
        """
        checkpoint: a .ckpt file. num_threads: 0 for all. device: 'auto', 'cpu' or 'cuda', where it computes; simulators, renderers
        and arrays that it is given work there too. The others as in pictura.evaluate(). Raises pictura.Error naming the file, or
        pictura.UsageError where it cannot see through these cameras.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def evaluate(self, observations: dict, *, scene: pictura._pictura.Scene = None, views: typing.Any = None, renderer: typing.Any = None, is_drawn: typing.Any = None) -> tuple:
        """
        Logits float32 [batch, 12] and values float32 [batch], on its device.
        
        observations: arrays [batch, ...] by name, as pictura.Simulator.observations. For a policy that reads images also scene, views
        [batch] and renderer, which is of make_renderer(); is_drawn: uint8 [batch], 0 where its images are black. Raises pictura.Error
        naming what is missing or does not fit.
        """
    def evaluation_world(self, steps: typing.SupportsInt | typing.SupportsIndex) -> dict:
        """
        The same for the paper's evaluation: episodes of so many steps, fixed conditioning and lights.
        """
    def make_controller(self, simulator: typing.Any, renderer: typing.Any = None, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> typing.Any:
        """
        A pictura.Controller that drives in this simulator, which works on the session's device: the most likely action, or draws
        keyed by seed, world, agent, episode and step as in training. renderer: for a policy that reads images, of make_renderer(), with
        the simulator's geometries. Raises pictura.Error where one is missing.
        """
    def make_renderer(self) -> typing.Any:
        """
        A pictura.Renderer of its images, to which the maps are to be uploaded; None where it reads no images.
        """
    def training_world(self) -> dict:
        """
        Options by which pictura.Simulator(maps, worlds, **options) makes the world that it was trained in.
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
    The paper's evaluation, as `pictura evaluate` does it, in worlds that no training has.
    
    checkpoint: of a policy; '' with a controller of the paper's world. maps: names, files or ranges as procedural:1-64. controller: 'lane', 'idm_lanes', 'random' or 'idle',
    which drives instead, or a function(observations) of NumPy's arrays [slots, ...] by name, as pictura.Simulator.observations has them, that
    returns actions int [slots], on the CPU. A function gets images too where cameras are named (rig, or width_px and height_px): `rgb` uint8
    [slots, cameras, 3, height, width], black for agents that are not active; rgb_0, rgb_1, ... where cameras have several sizes. densities: 'light', 'medium' and 'dense', 60, 120 and 150 agents a world, or agents_per_world of them.
    device, simulator, renderer: 'auto' or names; renderer '': as it was trained. rig, or width_px and height_px: other cameras.
    backbone: where the program of policy.backbone lies now. conditioning: numbers by name. light_cycles: 'phases' or 'independent',
    light_heads: 'as_mapped' or 'visible'; '': as it was trained. average: with the average of weights that the checkpoint holds. camera_severity: of
    randomized cameras, 0 to 2 (docs/explanation/cameras.md). decision_steps: for which an
    action is held; 0: as it was trained. others: who else drives, as {'lane': 0.3, 'other.safetensors': 0.2}:
    policies or controllers, and their shares of vehicles; 'blind', 'phantom_braking' and 'inattentive': shares of agents that the policy drives while impaired. on_progress: called with the fraction that is done and the seconds to come, from a thread of its own. Returns a dict: rows, one a density and driver (None: whom it measures): its counts, and each metric as (value, half of its 95 % interval); seconds,
    agent_steps, policy_hash, light_cycles, others. ^C raises KeyboardInterrupt. Raises pictura.Error naming file and key of bad input.
    """
def evaluate_robust(checkpoint: str, *, controller: str | collections.abc.Callable = '', scenarios: typing.SupportsInt | typing.SupportsIndex = 24, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, on_progress: typing.Any = None) -> dict:
    """
    The robust protocol, as `pictura evaluate --protocol robust` runs it: a fixed set of generated towns, other drivers and randomized
    cameras (docs/how-to/robust_benchmark.md).
    
    checkpoint: of a policy; '' with a controller: a name or a function, as in evaluate(). A function whose `rig`, or width_px and height_px, is
    given gets images of these cameras. scenarios: per condition; other numbers than the default are a trial. The other arguments are those of
    evaluate(); seed, conditioning and camera_severity are fixed. Returns a dict: rows, one a condition: part, name, not_driven (why the
    condition does not apply, or None), counts, and each metric as (value, half of its 95 % interval); pooled: the same over the conditions of
    'towns', 'others', 'cameras' and 'all'; seconds, agent_steps, policy_hash. ^C raises KeyboardInterrupt.
    """
def evaluate_scenes(checkpoint: str, scenes: collections.abc.Sequence[str], *, protocol: str = 'womd', controller: str | collections.abc.Callable = '', control: str | None = None, start_step: typing.SupportsInt | typing.SupportsIndex | None = None, steps: typing.SupportsInt | typing.SupportsIndex | None = None, densities: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] | None = None, rules: dict = {}, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, num_scenes: typing.SupportsInt | typing.SupportsIndex = 0, argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, rollouts: str = '', on_progress: typing.Any = None) -> dict:
    """
    The paper's zero-shot evaluation in recorded scenes, as `pictura evaluate --protocol` does it.
    
    checkpoint: of a policy; '' with a controller: 'log', 'inverse', 'idm', 'idm_lanes', 'random' or 'idle', which drives
    instead. scenes: files, folders, 'FILE#K'. protocol: 'womd', 'gpudrive', 'pufferdrive2', 'pufferdrive3', 'waymax' or 'simagents'; control, start_step, steps,
    densities (shares of road users that stay) and rules (values by name, docs/explanation/evaluation.md) replace what it says.
    first_scene, num_scenes: a part of the scenes; 0: all from the first on. rollouts: a file for them, with the protocol
    'simagents', as the Waymo sim-agents challenge takes them. The others as in evaluate(). Returns a dict: rows, one a
    density, with each metric as (value, half of its 95 % interval); agents, one for every driven road user of a scene, density and rollout;
    scenes, scored, without_drivers, faults (scenes that are left out, and why); seconds, agent_steps, policy_hash. ^C raises
    KeyboardInterrupt. Raises pictura.Error where no scene can be used.
    """
def probe_corner(policies: collections.abc.Sequence[str], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 5, batch: typing.SupportsInt | typing.SupportsIndex = 256, pairs: typing.SupportsInt | typing.SupportsIndex = 200, max_distance_m: typing.SupportsFloat | typing.SupportsIndex = 25.0, min_speed_mps: typing.SupportsFloat | typing.SupportsIndex = 2.0, user_range_m: typing.SupportsFloat | typing.SupportsIndex = 50.0, driver: str = '', control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    How policies drive on towards blind corners with a hidden vehicle, and towards empty ones like them, as `pictura probe
    corner` asks it.
    
    policies, maps, density, agents_per_world, scenes, steps, sample_steps and what follows argmax: as in probe_removal(). pairs: in
    all. max_distance_m: how far before the corner a policy may take over. min_speed_mps: of the ego then, and of who is hidden.
    user_range_m: how far before the junction that one may be. driver: 'lane' drives the scenes instead of the policies. control: 'none',
    'permuted' or 'untrained'. batch: pairs that are run at once. cases_file: a CSV file for every run. replay, case, cameras: as
    in probe_removal(); a case is a pair, by default that of the example's figure. Returns a dict, that of the command's summary.json
    (docs/explanation/probes.md). ^C raises KeyboardInterrupt. Raises pictura.Error naming file and key of bad input.
    """
def probe_pedestrian(policies: collections.abc.Sequence[str], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 10, batch: typing.SupportsInt | typing.SupportsIndex = 4096, paths: typing.SupportsInt | typing.SupportsIndex = 32, hider_range_m: typing.SupportsFloat | typing.SupportsIndex = 30.0, min_speed_mps: typing.SupportsFloat | typing.SupportsIndex = 1.0, height_m: typing.SupportsFloat | typing.SupportsIndex = 1.2000000476837158, control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    How policies' value and braking change as a pedestrian comes out from behind a vehicle and is hidden again, as
    `pictura probe pedestrian` asks it.
    
    policies, maps, density, agents_per_world, scenes, steps, sample_steps, batch and what follows argmax: as in probe_removal().
    paths: in all, each through one state. hider_range_m: how far away the vehicle may be that a path begins behind. min_speed_mps:
    of the ego, forwards. height_m: of the pedestrian. control: 'none', 'nobody' or 'untrained'. cases_file: a CSV file for every place of every path. replay, case, cameras: as in probe_removal(). Returns a dict, that of
    the command's summary.json (docs/explanation/probes.md). ^C raises KeyboardInterrupt. Raises pictura.Error naming file and key of bad
    input.
    """
def probe_removal(policies: collections.abc.Sequence[str], maps: collections.abc.Sequence[str], *, agents_per_world: typing.SupportsInt | typing.SupportsIndex = 0, steps: typing.SupportsInt | typing.SupportsIndex = 600, density: str = 'medium', scenes: typing.SupportsInt | typing.SupportsIndex = 0, first_scene: typing.SupportsInt | typing.SupportsIndex = 0, sample_steps: typing.SupportsInt | typing.SupportsIndex = 10, batch: typing.SupportsInt | typing.SupportsIndex = 4096, removals: typing.SupportsInt | typing.SupportsIndex = 88000, range_m: typing.SupportsFloat | typing.SupportsIndex = 50.0, control: str = 'none', argmax: bool = True, seed: typing.SupportsInt | typing.SupportsIndex = 1, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, device: str = 'auto', simulator: str = 'auto', renderer: str = '', samples: str = '', rig: str = '', width_px: typing.SupportsInt | typing.SupportsIndex = 0, height_px: typing.SupportsInt | typing.SupportsIndex = 0, backbone: str = '', conditioning: dict = {}, average: bool = False, decision_steps: typing.SupportsInt | typing.SupportsIndex = 0, camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, light_cycles: str = '', light_heads: str = '', cases_file: str = '', replay: str = '', case: typing.SupportsInt | typing.SupportsIndex | None = None, cameras: bool = False, on_progress: typing.Any = None) -> typing.Any:
    """
    How policies' value and braking change when one road user is taken away, as `pictura probe removal` asks it.
    
    policies: checkpoints or safetensors; the world is the first one's. maps, density, agents_per_world, steps and what follows
    argmax: as in evaluate(). scenes: how many scenarios are driven, an equal share by each policy; 0: as many on each map for each
    policy, two a map or more. removals: in all. sample_steps: between states. range_m: how far away a user may be. control: 'none',
    'nobody', 'permuted' or 'untrained'. batch: cases in a call. cases_file: a CSV file for every case. replay: a page *.html that plays the scene of one case and shows
    its images with and without the road user (docs/reference/replay.md); case: its number in cases_file, by default the one where the first
    policy's value changes most; cameras: keeps the ego's images of every step. Returns a dict, that of the command's
    summary.json (docs/explanation/probes.md). ^C raises KeyboardInterrupt. Raises pictura.Error naming file and key of bad input.
    """
def train(config: str, out: str, *, overrides: collections.abc.Sequence[str] = [], old_run: str = 'refuse', init_from: str = '', minutes: typing.SupportsFloat | typing.SupportsIndex = 0.0, on_progress: typing.Any = None, on_notice: typing.Any = None) -> dict:
    """
    Trains by self-play as `pictura train` does, and writes the same files into the folder `out`.
    
    config: a TOML file (docs/reference/configuration.md). overrides: 'train.updates=2'. old_run: of a run that lies in `out`, 'refuse', 'resume'
    or 'overwrite'. init_from: a checkpoint whose weights it begins with. minutes: of wall time; 0: no limit. on_progress: called
    after every update with a dict: update, updates, agent_steps, agent_steps_per_s, episode_return, eta_s, scalars (those of
    progress.csv). on_notice: called with a text. They are called from a thread of training's own, and what they raise ends it.
    Returns a dict: agent_steps, updates, agent_steps_per_s, episode_return, km_driven, checkpoint, policy_hash and more. ^C ends it
    after the present update, saves, and raises KeyboardInterrupt. Raises pictura.Error naming file and key of bad input.
    """
