"""
The pictura library: maps, scenes, renderers and simulators. Import `pictura`, which has these names.
"""
from __future__ import annotations
import collections.abc
import numpy
import numpy.dtypes
import numpy.typing
import typing
__all__: list[str] = ['AGENT_FIELDS', 'Array', 'BOX_DTYPE', 'COMMAND_DTYPE', 'CONDITIONING_NAMES', 'Camera', 'Controller', 'EVENTS', 'EVENT_TOTALS', 'Error', 'Geometry', 'HAS_CUDA', 'IDLE_ACTION', 'INFRACTIONS', 'INSERTED_DTYPE', 'Images', 'LANE_TYPES', 'LIGHT_STATES', 'LINE_TYPES', 'LiveView', 'Map', 'NUM_ACTIONS', 'OBSERVATION_ARRAYS', 'QUERY_DTYPE', 'REALISM_VERSIONS', 'REWARD_TERMS', 'Recorder', 'Renderer', 'Rig', 'Scenario', 'Scene', 'SceneFile', 'SceneRecorder', 'Simulator', 'Snapshot', 'StepResult', 'TRACK_TYPES', 'UsageError', 'VIEW_DTYPE', 'draw_worlds', 'known_towns', 'make_views', 'map_folder', 'renderer_names', 'simulator_names', 'write_gallery']
class Error(RuntimeError):
    """
    The work failed; the message names what was expected and what came.
    """
class UsageError(Error, ValueError):
    """
    Invalid usage: an argument that does not exist or does not fit the others.
    """
class Array:
    """
    Array in the library's memory, lent without a copy.
    
    NumPy accesses it with `numpy.asarray(array)` if it is on the CPU; `numpy.from_dlpack`, `torch.from_dlpack`, JAX and CuPy access
    it on any device. The memory lives as long as any of these references, even after its simulator or renderer is gone. Its
    contents change with the calls that write it.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
        >>> ego = simulator.observations['ego']
        >>> ego.shape, ego.dtype, ego.device
        ((4, 9), 'float32', 'cpu')
        >>> ego.numpy().base is not None            # a view, not a copy
        True
    """
    def __array__(self, dtype: typing.Any = None, copy: typing.Any = None) -> typing.Any:
        ...
    def __dlpack__(self, *, stream: typing.Any = None, max_version: typing.Any = None, dl_device: typing.Any = None, copy: typing.Any = None) -> typing.Any:
        """
        DLPack's protocol, versioned if max_version is (1, 0) or later. Raises BufferError if the array cannot be lent.
        """
    def __dlpack_device__(self) -> tuple[int, int]:
        """
        DLPack's (device type, index): (1, 0) on the CPU, (2, i) on CUDA device i.
        """
    def __getitem__(self, arg0: typing.Any) -> typing.Any:
        """
        Indexes the NumPy view.
        """
    def __len__(self) -> int:
        ...
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def __repr__(self) -> str:
        ...
    def numpy(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        Returns a NumPy view. Raises TypeError if the array is not on the CPU.
        """
    def torch(self) -> typing.Any:
        """
        Returns a torch tensor over the same memory. Imports torch.
        """
    @property
    def device(self) -> str:
        """
        'cpu' or 'cuda:0'.
        """
    @property
    def dtype(self) -> str:
        """
        NumPy's name of the element type, for instance 'float32'.
        """
    @property
    def read_only(self) -> bool:
        """
        Whether the array is read-only.
        """
    @property
    def shape(self) -> tuple:
        """
        Lengths, a tuple of int.
        """
    @property
    def strides(self) -> tuple:
        """
        Strides in elements, a tuple of int.
        """
class Geometry:
    """
    Geometry of a map for renderers: strips on the road, walls, light heads.
    
    Examples:
        >>> pictura.Map.load('procedural:3').geometry(walls=False).num_walls
        0
        >>> line = ([[0, 0, 0], [100, 0, 0]], 0.2, (1, 1, 1))     # points in m, width in m, white
        >>> pictura.Geometry([line], walls=[[0, 5, 0, 50, 5, 0, 3]]).num_walls
        1
    """
    def __init__(self, lines: collections.abc.Sequence[tuple[typing.Annotated[numpy.typing.ArrayLike, numpy.float32], typing.SupportsFloat | typing.SupportsIndex, typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]]] = [], walls: typing.Annotated[numpy.typing.ArrayLike, numpy.float32] = ...) -> None:
        """
        Creates a custom geometry.
        
        lines: list of (points [n, 3] in metres, width in metres, colour of three numbers in [0, 1]).
        walls: float [n, 7]: both ends of the foot, in metres, and the height.
        Raises pictura.Error for other shapes; renderers reject numbers that are not finite.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    @property
    def num_lights(self) -> int:
        """
        Number of light states of a world with this geometry.
        """
    @property
    def num_strips(self) -> int:
        """
        Number of straight pieces of lines.
        """
    @property
    def num_walls(self) -> int:
        """
        Number of wall faces.
        """
class Map:
    """
    Road network: lanes, markings, edges, lights. Immutable; simulators and renderers share it.
    
    Positions are metres in the map's frame, z up; `origin_m` is the frame's origin in the file's coordinates.
    
    Examples:
        >>> town = pictura.Map.load('procedural:3')                # or 'Town01', 'city:1', 'mytown.xodr'
        >>> town.name, town.draw(320, 200).shape
        ('procedural:3', (200, 320, 3))
        >>> town.arrays()['lane_points'].shape[1]                  # x, y, z, heading, width, arc length
        6
    """
    @staticmethod
    def from_text(text: str, source: str = 'text', *, strict: bool = False) -> Map:
        """
        Parses the text of an OpenDRIVE file; `source` is its name in messages. Raises as load() does.
        """
    @staticmethod
    def load(name: str, *, strict: bool = False, chord_error_m: typing.SupportsFloat | typing.SupportsIndex = 0.019999999552965164) -> Map:
        """
        Loads a map by name: an OpenDRIVE file (.xodr), a Lanelet2 file (.osm, or .osm@LATITUDE,LONGITUDE in coordinates about
        that place), a town of the map folder, 'procedural:SEED', or 'city:SEED'.
        
        Faults with a single sensible meaning are repaired and listed in `mends`. strict: rejects such faults too. chord_error_m:
        maximum distance of sampled curves from the true curves.
        Raises pictura.Error naming file, line and element; pictura.UsageError if the map does not exist.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def __repr__(self) -> str:
        ...
    def arrays(self) -> dict:
        """
        Copies the network's geometry to NumPy arrays by name.
        
        lane_points float32 [points, 6]: x, y, z, heading in radians, width, arc length; lane_point_range int32 [lanes, 2] is each
        lane's range of points. Ranges are half-open. lane_type uint8 [lanes] indexes pictura.LANE_TYPES; lane_links int32 lists
        successors and predecessors; road_edges, stop_lines and building_lines float32 [n, 6] are two ends each. Lengths are metres.
        """
    def draw(self, width_px: typing.SupportsInt | typing.SupportsIndex = 1024, height_px: typing.SupportsInt | typing.SupportsIndex = 1024) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Draws the map from above, uint8 [height, width, 3], north up. Sizes from 16 to 8192 px.
        """
    def geometry(self, walls: bool = True, wall_seed: typing.SupportsInt | typing.SupportsIndex = 0, light_heads: str = 'as_mapped') -> Geometry:
        """
        Returns the map's geometry for renderers. walls: adds walls along the building lines, with heights drawn from wall_seed.
        light_heads: as for Simulator.
        """
    @property
    def facts(self) -> dict:
        """
        Counts and lengths by name, as `pictura map` prints them.
        """
    @property
    def geo_reference(self) -> str:
        """
        PROJ string of the file's coordinates; may be empty.
        """
    @property
    def mends(self) -> list[tuple[str, str, str]]:
        """
        Repaired faults of the file: (kind, repair, message) each.
        """
    @property
    def name(self) -> str:
        """
        Name of the map: 'Town01', 'procedural:7', or the file's stem.
        """
    @property
    def origin_m(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        """
        File coordinates of the map's origin, three floats in metres.
        """
class Scenario(Map):
    """
    Recorded scene: a map, the tracks of all road users, and the recorded lights. Immutable.
    
    A scenario is the map of worlds whose agents are its tracks, in their order, from `start_step` on:
    pictura.Simulator([scene], [(0, scene.num_tracks)], **scene.world()). Commands of kind 3 and the controller 'log' replay it.
    
    Examples:
        >>> scene = pictura.Scenario.load('drive.scenario')            # or FILE.tfrecord#7, FILE.json, a folder
        >>> simulator = pictura.Simulator([scene], [(0, scene.num_tracks)], **scene.world())
        >>> simulator.run(pictura.Controller('log', simulator), 10)    # all as recorded
        >>> scene.tracks()['position_m'].shape == (scene.num_tracks, scene.num_steps, 3)
        True
    """
    @staticmethod
    def from_arrays(tracks: dict, lanes: dict, *, lines: dict | None = None, edges: dict | None = None, crosswalks: dict | None = None, stop_signs: dict | None = None, lights: dict | None = None, dt_s: typing.SupportsFloat | typing.SupportsIndex = 0.1, current_step: typing.SupportsInt | typing.SupportsIndex | None = None, sdc_track: typing.SupportsInt | typing.SupportsIndex | None = None, id: str = '', origin_m: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"] | None = None, tolerance_m: typing.SupportsFloat | typing.SupportsIndex = 0.01) -> Scenario:
        """
        Creates a scene from arrays in dicts: NumPy arrays, or objects that convert to them. Lengths are metres, positions float64 in
        any frame.
        
        tracks: id int64 [T], type [T] (index in pictura.TRACK_TYPES), size_m [T, 3] (length, width, height), valid bool [T, S],
        position_m [T, S, 3] (of the box's foot), heading_rad [T, S], velocity_mps [T, S, 2]; states that are not valid may hold
        anything.
        Polylines are points float64 [P, 3], one polyline after the other, and begin int32 [N + 1], the offset of each polyline in the
        points and the end of the last.
        lanes: points and begin along the centre, id int64 [N] of 0 or more, type [N] (pictura.LANE_TYPES); if known speed_limit_mps [N]
        (0: unknown), width_m [P] (all 0 along a lane: unknown), in_junction bool [N], entries and exits, ids of lanes one after the
        other, with entries_begin and exits_begin [N + 1], left_neighbor and right_neighbor [N], ids of lanes of the same direction, or
        -1. Without entries and exits, lanes are linked at common ends.
        lines: points, begin, type [N] (pictura.LINE_TYPES). edges: points and begin, with the road on the left. crosswalks: points and
        begin of their outlines. stop_signs: position_m [N, 3], lanes with lanes_begin. lights: lanes with lanes_begin [L + 1], states
        [L, S] (pictura.LIGHT_STATES), and stop_lines [L, 2, 3]; by default stop lines cross the begins of the lanes.
        dt_s: time between states. current_step: step of the present; None: 10, or the last step. sdc_track: index of the self-driving
        car's track. origin_m: of the map, about which numbers are rounded to float32; None: the middle of lanes and edges. tolerance_m:
        maximum deviation of lines when they are thinned; 0 keeps all points.
        Raises pictura.UsageError naming the array and the element, pictura.Error if the arrays do not form a scene.
        """
    @staticmethod
    def load(name: str, *, start_step: typing.SupportsInt | typing.SupportsIndex = 0) -> Scenario:
        """
        Loads a scene by name: FILE.json, FILE.bin, FILE.scenario, a file with '.tfrecord' in its name, or a folder of these; '#7' or
        '#SCENARIO_ID' selects one of several scenes.
        
        start_step: step of the recording at which episodes begin.
        Raises pictura.Error naming file, record and field; pictura.UsageError if the scene or step does not exist.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def __repr__(self) -> str:
        ...
    def draw(self, width_px: typing.SupportsInt | typing.SupportsIndex = 1024, height_px: typing.SupportsInt | typing.SupportsIndex = 1024) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Draws the scene from above, uint8 [height, width, 3], north up: the paths of all tracks, and the road users at start_step.
        
        Sizes from 16 to 8192 px.
        """
    def inverse_actions(self, num_threads: typing.SupportsInt | typing.SupportsIndex = 0) -> dict:
        """
        Computes the actions with which the simulator's dynamics follow the recording most closely, as NumPy arrays by name.
        
        actions int32, is_followed bool and error_m float32 [tracks, steps from start_step on]: for the step after each state the
        action, whether its start and end states are recorded, and the distance of its end from the recorded position. num_threads: 0
        for all.
        """
    def mask(self, words: str, *, absent: bool = False) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Returns uint8 [tracks]: 1 for the tracks that comma-separated words select: self (the self-driving car), vehicles (the others),
        others (all non-vehicles), all, tracks_to_predict, objects_of_interest, and ids of tracks.
        
        absent: includes tracks that are absent at start_step. Raises pictura.UsageError for another word, and if no track remains.
        """
    def save(self, path: str) -> None:
        """
        Writes the scene, completely or not at all, as *.scenario, which load() reads back to the bit.
        
        Raises pictura.UsageError for another ending, pictura.Error naming the file.
        """
    def starting_at(self, start_step: typing.SupportsInt | typing.SupportsIndex) -> Scenario:
        """
        Returns the same scene with episodes that begin at another step; nothing is copied.
        
        Raises pictura.UsageError for a step that the scene does not have.
        """
    def to_arrays(self) -> dict:
        """
        Returns the arguments by name with which pictura.Scenario.from_arrays(**arrays) creates the same scene.
        
        The arrays do not contain: tracks to predict and tracks marked for replay, walls, parking spaces, signs other than stop signs,
        widths of paint, and the data with which a saved run replays to the bit.
        """
    def tracks(self) -> dict:
        """
        Copies the tracks to NumPy arrays by name.
        
        id int64 [tracks], as in the file; type uint8 [tracks] indexes pictura.TRACK_TYPES; size_m float32 [tracks, 3]: length, width,
        height. valid bool [tracks, steps]; position_m float32 [tracks, steps, 3], centre of the box's foot in the map's frame;
        heading_rad [tracks, steps]; velocity_mps [tracks, steps, 2]: 0 where not valid.
        """
    def with_recorded_lights(self) -> Scenario:
        """
        Returns the same scene with worlds that use its recorded lights: they are drawn and observed, and red lights count.
        """
    def world(self, **kwargs) -> dict:
        """
        Returns the options with which pictura.Simulator([scene], worlds, **options) creates the scene's worlds: the recording's time
        step, an episode as long as the rest of the recording, no walls, no parked cars, no early end, plain dynamics.
        
        All other given options are kept, for instance those of a pictura.PolicySession: scene.world(**session.training_world()).
        """
    @property
    def current_step(self) -> int:
        """
        Last step of the history that predictors are given.
        """
    @property
    def dt_s(self) -> float:
        """
        Seconds between states.
        """
    @property
    def facts(self) -> dict:
        """
        Counts and lengths of the map, and counts of tracks and lights, by name, as `pictura map` prints them.
        """
    @property
    def format(self) -> str:
        """
        File format: 'womd', 'gpudrive', 'pufferdrive v1', ...
        """
    @property
    def id(self) -> str:
        """
        Id of the recording, such as '637f20cafde22ff8'; may be empty.
        """
    @property
    def notes(self) -> list:
        """
        Elements that were dropped or changed when the file was converted: (what, how often, first place) each.
        """
    @property
    def num_steps(self) -> int:
        """
        Number of states of each track, from the recording's first step on.
        """
    @property
    def num_tracks(self) -> int:
        """
        Number of agents of its worlds.
        """
    @property
    def sdc_track(self) -> int | None:
        """
        Track of the self-driving car; None if the file does not mark it.
        """
    @property
    def start_step(self) -> int:
        """
        Step of the recording at which episodes begin.
        """
class SceneRecorder:
    """
    Records the present episode of a world of a simulator on the CPU as a scene: every step from now on, by any function, as long as
    the recorder lives.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
        >>> recorder = pictura.SceneRecorder(simulator)
        >>> simulator.run(pictura.Controller('lane', simulator), 30)
        >>> recorder.scenario(id='my drive', self_agent=0).save('mine.scenario')
        >>> recorder.num_steps
        30
    """
    def __init__(self, simulator: typing.Any, *, world: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Raises pictura.UsageError if the world does not exist or the simulator is on a device.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def scenario(self, *, id: str = '', self_agent: typing.SupportsInt | typing.SupportsIndex = -1) -> Scenario:
        """
        Returns the pictura.Scenario recorded so far: controlled agents and parked cars as tracks, with the number of their box in the
        world as id, and lights as recorded lights.
        
        self_agent: agent of the world whose track becomes the self-driving car's; -1: none. Raises pictura.UsageError for an agent that
        was never present.
        """
    @property
    def num_steps(self) -> int:
        """
        Number of steps so far.
        """
class Camera:
    """
    Pinhole camera on a body: x forward, y left, z up, in metres from the rig's origin. Angles are radians: yaw is
    counter-clockwise, positive pitch looks up, positive roll is clockwise as seen from behind.
    
    Examples:
        >>> roof = pictura.Camera('roof', 128, 72, position_m=(1.0, 0.0, 1.6), pitch_rad=-0.1)
        >>> roof.focal_x_px
        102.4000015258789
    """
    name: str
    def __getstate__(self) -> tuple[str, int, int, float, float, float, float, float, float, float, float, float, float]:
        ...
    def __init__(self, name: str, width_px: typing.SupportsInt | typing.SupportsIndex, height_px: typing.SupportsInt | typing.SupportsIndex, *, focal_px: typing.SupportsFloat | typing.SupportsIndex | None = None, position_m: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"] = [1.5, 0.0, 1.5], yaw_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, pitch_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0, roll_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        The principal point is the middle; focal_px defaults to 0.8 times the width, about 64 degrees across.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def __repr__(self) -> str:
        ...
    def __setstate__(self, arg0: tuple) -> None:
        ...
    @property
    def center_x_px(self) -> float:
        ...
    @center_x_px.setter
    def center_x_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def center_y_px(self) -> float:
        ...
    @center_y_px.setter
    def center_y_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def focal_x_px(self) -> float:
        ...
    @focal_x_px.setter
    def focal_x_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def focal_y_px(self) -> float:
        ...
    @focal_y_px.setter
    def focal_y_px(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def height_px(self) -> int:
        ...
    @height_px.setter
    def height_px(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def pitch_rad(self) -> float:
        ...
    @pitch_rad.setter
    def pitch_rad(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def position_m(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        ...
    @position_m.setter
    def position_m(self, arg1: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(3)"]) -> None:
        ...
    @property
    def roll_rad(self) -> float:
        ...
    @roll_rad.setter
    def roll_rad(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
    @property
    def width_px(self) -> int:
        ...
    @width_px.setter
    def width_px(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None:
        ...
    @property
    def yaw_rad(self) -> float:
        ...
    @yaw_rad.setter
    def yaw_rad(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None:
        ...
class Rig:
    """
    One or more cameras of any sizes on a body, in the order of images.
    
    Examples:
        >>> [camera.name for camera in pictura.Rig.paper(96, 54).cameras]
        ['front', 'front_left', 'front_right', 'back']
        >>> len(pictura.Rig([pictura.Camera('front', 64, 36, position_m=(1.5, 0, 1.4))]))
        1
    """
    @staticmethod
    def load(path: str) -> Rig:
        """
        Reads a rig from a TOML file. Raises pictura.Error naming file, camera and key.
        """
    @staticmethod
    def paper(width_px: typing.SupportsInt | typing.SupportsIndex = 96, height_px: typing.SupportsInt | typing.SupportsIndex = 54, square_pixels: bool = False) -> Rig:
        """
        Returns the paper's four cameras: front, front left, front right and back. Sizes from 1 to 8192 px.
        """
    def __getstate__(self) -> tuple[list[Camera]]:
        ...
    def __init__(self, cameras: collections.abc.Sequence[Camera]) -> None:
        """
        Raises pictura.Error unless there are 1 to 64 valid cameras.
        """
    def __len__(self) -> int:
        ...
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def __setstate__(self, arg0: tuple) -> None:
        ...
    @property
    def cameras(self) -> list[Camera]:
        ...
class Scene:
    """
    Moving objects: boxes of agents and states of lights, for one or more worlds. A simulator's `scene` follows the simulator; a
    scene of arrays is a copy of the arrays.
    
    Examples:
        >>> car = pictura.Scene(center_m=[[12, 0, 0]], heading_rad=[0], size_m=[[4.4, 1.8, 1.5]], agent_class=[0])
        >>> car.num_worlds, car.boxes.shape
        (1, (1, 36))
    """
    def __init__(self, center_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], heading_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], size_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], agent_class: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], *, world_begin: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, geometry: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, light_states: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, light_begin: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None) -> None:
        """
        center_m [n, 3]: centre of the box's foot. heading_rad [n]. size_m [n, 3]: length, width, height. agent_class [n]: 0 vehicle, 1
        cyclist, 2 pedestrian. world_begin [worlds + 1]: first box of each world; default: a single world. geometry [worlds]: handles of
        uploaded geometries; default: 0. light_states: 0 off, 1 red, 2 yellow, 3 green, 4 unknown, of all worlds; light_begin [worlds +
        1]. Raises pictura.Error for other shapes; render() rejects arrays that do not fit together.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    @property
    def boxes(self) -> Array:
        """
        uint8 [boxes, 36], read-only: `numpy.asarray(boxes).view(BOX_DTYPE)[:, 0]` has their fields by name.
        """
    @property
    def num_worlds(self) -> int:
        """
        Worlds.
        """
class SceneFile:
    """
    Scene of one TOML file: geometry, boxes, rig and views.
    
    Examples:
        >>> text = '''size_px = [96, 54]
        ... [[view]]
        ... x_m = 0.0
        ... y_m = 0.0
        ... heading_deg = 0.0
        ... '''
        >>> _ = pathlib.Path('empty.toml').write_text(text)
        >>> pictura.SceneFile('empty.toml').view_names
        ['view0']
    """
    def __init__(self, path: str) -> None:
        """
        Raises pictura.Error naming file, line, table and key.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    @property
    def geometry(self) -> Geometry:
        ...
    @property
    def line_floor_px(self) -> float:
        ...
    @property
    def rig(self) -> Rig:
        ...
    @property
    def scene(self) -> Scene:
        """
        Its world is on geometry 0.
        """
    @property
    def view_names(self) -> list[str]:
        ...
    @property
    def views(self) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
        """
        VIEW_DTYPE [n].
        """
class Images:
    """
    Images of views by each camera of a rig, in the renderer's memory, and their planes if requested. A renderer can draw into them
    repeatedly.
    
    Examples:
        >>> renderer = pictura.Renderer('cpu', pictura.Rig.paper(32, 18))
        >>> images = renderer.make_images(num_views=5)
        >>> images.rgb.shape, images.camera(0).shape
        ((5, 4, 3, 18, 32), (5, 3, 18, 32))
    """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def camera(self, index: typing.SupportsInt | typing.SupportsIndex) -> Array:
        """
        [views, 3, height, width] of one camera.
        """
    def planes(self, camera: typing.SupportsInt | typing.SupportsIndex) -> dict:
        """
        Returns planes of the front surface at each pixel's centre, [views, height, width]: depth_m float32 (infinite without a
        surface), class_id uint8 (0: none), instance_id uint16 (1 + the agent's index in its world, 0: no agent). Raises pictura.Error
        for images without planes.
        """
    @property
    def blocks(self) -> list:
        """
        Arrays [views, cameras of one size, 3, height, width], one for each distinct size.
        """
    @property
    def num_views(self) -> int:
        """
        Capacity in views.
        """
    @property
    def rgb(self) -> Array:
        """
        [views, cameras, 3, height, width], for a rig whose cameras have one size.
        """
class _RendererInside:
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
class Renderer:
    """
    Draws scenes: 'cpu', 'cuda', 'gl' ('gl:egl', 'gl:osmesa'), 'null', or 'auto'. One thread at a time; several renderers are
    independent. On CUDA its work is enqueued on `stream`.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
        >>> renderer = pictura.Renderer('cpu', pictura.Rig.paper(32, 18))
        >>> for handle, geometry in simulator.geometries.items():
        ...     renderer.upload(handle, geometry)
        >>> images = renderer.render(simulator.scene, simulator.views)
        >>> images.rgb.numpy().shape                    # views, cameras, channels, height, width
        (4, 4, 3, 18, 32)
    """
    @staticmethod
    def _of(inside: _RendererInside) -> Renderer:
        ...
    def __init__(self, name: str = 'auto', rig: Rig | None = None, *, device: str = 'cpu', num_threads: typing.SupportsInt | typing.SupportsIndex = 0, line_floor_px: typing.SupportsFloat | typing.SupportsIndex = 0.3499999940395355, debug_palette: bool = False, samples: str = '1', camera_severity: typing.SupportsFloat | typing.SupportsIndex = 0.0, stream: typing.Any = None) -> None:
        """
        rig: default: the paper's. device: memory of scenes, views and images, 'cpu' or 'cuda:0'. num_threads: 0 for all. line_floor_px:
        minimum width of a line on screen. debug_palette: tints halted and parked agents. samples: for 'gl', '4' (MSAA) or '4x4'
        (supersampling). camera_severity: severity of randomized cameras, 0 to 2, as in evaluations (docs/explanation/cameras.md); draws
        are keyed by the field `key` of views, which a simulator fills. stream: a cudaStream_t as int; None: the legacy default stream.
        Raises pictura.UsageError listing the names, pictura.Error if the backend cannot run here.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def _inside(self) -> _RendererInside:
        ...
    def check(self) -> None:
        """
        Waits for the work on the stream; raises pictura.Error for faults found by a device.
        """
    def make_images(self, num_views: typing.SupportsInt | typing.SupportsIndex, *, dtype: str = 'uint8', planes: bool = False) -> Images:
        """
        Allocates images of num_views views: 'uint8' of 0 to 255, or 'float32' or 'float16' (not on all renderers) of 0 to 1.
        """
    def render(self, scene: Scene, views: typing.Any, out: typing.Any = None, *, dtype: str = 'uint8', planes: bool = False) -> typing.Any:
        """
        Draws every camera for every view. Returns `out`.
        
        views: VIEW_DTYPE [n], or a simulator's. out: Images, or for a rig of one size an array [n, cameras, 3, height, width] of uint8,
        float32, float16 or bfloat16 (0 to 255) in the renderer's memory (NumPy, torch, ...); default: new Images of `dtype` and
        `planes`. On CUDA the call returns when the work is enqueued; on the CPU ^C ends it between views. Raises pictura.Error naming
        the array that does not fit.
        """
    def upload(self, handle: typing.SupportsInt | typing.SupportsIndex, geometry: Geometry) -> None:
        """
        Copies a geometry under `handle`, 0 to 65535, which scenes refer to. Raises pictura.Error if the geometry is invalid.
        """
    def visibility(self, scene: Scene, views: typing.Any, queries: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> numpy.typing.NDArray[numpy.float32]:
        """
        Returns the visibility of agents: for each query of (view, box of the scene), int [n, 2], the coverage in the view's images over
        the coverage when drawn alone, float32 [n]; NaN outside all cameras' frames.
        """
    @property
    def choice(self) -> str:
        """
        Selected renderer, with the reason.
        """
    @property
    def device(self) -> str:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def rig(self) -> Rig:
        ...
    @property
    def stream(self) -> int:
        """
        cudaStream_t of the work, as int; 0: the legacy default stream.
        """
    @stream.setter
    def stream(self, arg1: typing.Any) -> None:
        ...
class StepResult:
    """
    Results of a step, one element per slot, in the simulator's memory; every step overwrites the same arrays.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
        >>> result = simulator.step(np.full(4, pictura.IDLE_ACTION, np.int32))
        >>> result.reward.shape, result.reward_terms.shape
        ((4,), (4, 11))
    """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    @property
    def distance_m(self) -> typing.Any:
        """
        float32 [slots]: distance driven in this step.
        """
    @property
    def refusal(self) -> typing.Any:
        """
        uint8 [slots]: reason why the agent is absent from this episode: 1 no place, 2 all places taken; 0: it is present.
        """
    @property
    def reward(self) -> typing.Any:
        """
        float32 [slots].
        """
    @property
    def reward_terms(self) -> typing.Any:
        """
        float32 [slots, 11]: terms of the reward, in the order of pictura.REWARD_TERMS.
        """
    @property
    def terminated(self) -> typing.Any:
        """
        bool [slots]: an infraction ended the agent's episode in this step.
        """
    @property
    def truncated(self) -> typing.Any:
        """
        bool [slots]: the episode ended for another reason: bootstrap.
        """
    @property
    def valid(self) -> typing.Any:
        """
        bool [slots]: the agent was active when the step began: learn from it.
        """
class Snapshot:
    """
    State that a simulator keeps in its own memory.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
        >>> before, snapshot = simulator.state_hash(), simulator.snapshot()
        >>> simulator.run(pictura.Controller('lane', simulator), 10)
        >>> simulator.restore(snapshot)
        >>> simulator.state_hash() == before
        True
    """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
class _SimulatorInside:
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
class _ControllerInside:
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
class Controller:
    """
    Driver in one simulator on the CPU: 'lane' (the lane keeper), 'idm_lanes' (along lanes, behind others), 'idle' or 'random', in
    worlds of recorded scenes 'log', 'inverse' or 'idm', a policy of a pictura.PolicySession, or several of these.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
        >>> simulator.run(pictura.Controller('lane', simulator), steps=50)
        >>> commands = pictura.Controller('idle', simulator).act(simulator)
        >>> commands['action'].shape
        (8,)
    """
    @staticmethod
    def _of(inside: _ControllerInside) -> Controller:
        ...
    @staticmethod
    def shared(drivers: collections.abc.Sequence[tuple[Controller, typing.Any]], simulator: Simulator) -> Controller:
        """
        Returns a controller of several drivers that share a simulator's slots, of (controller, mask): if two command a slot, the later
        one drives.
        
        mask: uint8 or bool [slots] in the simulator's memory, which is read at every step; None: all slots. Raises pictura.Error for
        another array and for a controller of another simulator.
        """
    def __init__(self, name: str, simulator: Simulator, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Raises pictura.UsageError listing the names.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def act(self, simulator: Simulator) -> typing.Any:
        """
        Returns commands for all slots, which may be changed before step_commands() executes them: NumPy's COMMAND_DTYPE [slots], or
        uint8 [slots, 28] on CUDA. Every call returns the same memory.
        """
    @property
    def name(self) -> str:
        ...
class Simulator:
    """
    Many worlds, each on one map, stepped together. Arrays have one element per slot: the controlled agents of world 0, then those
    of world 1, and so on. Executors 'cpu' and 'cuda' give the same bits.
    
    One thread at a time; several simulators are independent. The GIL is released while C++ works. On CUDA its work is enqueued on
    `stream`, calls return before it is done, and invalid values raise an error in check() or a later call.
    
    Examples:
        >>> town = pictura.Map.load('procedural:3')
        >>> simulator = pictura.Simulator([town], [(0, 16)] * 4, seed=1)          # four worlds of sixteen agents
        >>> result = simulator.step(np.full(simulator.num_slots, pictura.IDLE_ACTION, np.int32))
        >>> result.reward.numpy().shape, simulator.observations['lanes'].numpy().shape
        ((64,), (64, 80, 7))
    """
    def __init__(self, maps: collections.abc.Sequence[Map], worlds: collections.abc.Sequence, *, executor: str = 'auto', device: str = 'cpu', seed: typing.SupportsInt | typing.SupportsIndex = 0, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, dt_s: typing.SupportsFloat | typing.SupportsIndex = 0.10000000149011612, episode_steps: typing.SupportsInt | typing.SupportsIndex = 1280, reset_inactive_fraction: typing.SupportsFloat | typing.SupportsIndex = 0.4000000059604645, pedestrian_fraction: typing.SupportsFloat | typing.SupportsIndex = 0.10000000149011612, cyclist_fraction: typing.SupportsFloat | typing.SupportsIndex = 0.10000000149011612, parked_cars: typing.SupportsInt | typing.SupportsIndex = 32, light_cycles: str = 'phases', walls: bool = True, wall_seed: typing.SupportsInt | typing.SupportsIndex = 0, light_heads: str = 'as_mapped', wall_observations: bool = False, reset_at_standstill: bool = False, blind: typing.SupportsFloat | typing.SupportsIndex = 0.0, phantom_braking: typing.SupportsFloat | typing.SupportsIndex = 0.0, inattentive: typing.SupportsFloat | typing.SupportsIndex = 0.0, stagger_episodes: bool = False, fixed_lights: bool = False, auxiliary_observations: bool = True, vector_observations: bool = True, conditioning: dict = {}, stream: typing.Any = None) -> None:
        """
        Simulators of worlds on maps, at the start of their first episodes. Defaults are the paper's training world.
        
        Args:
            maps: Maps of the worlds.
            worlds: One (index of the map, agents) or (map, agents, global world) a world; the global world keys its random numbers.
            executor: 'cpu', 'cuda' or 'auto'.
            device: Memory of observations and scenes: 'cpu', 'cuda' or 'cuda:INDEX'.
            seed: Seed of all random numbers.
            num_threads: Threads of the host; 0: all.
            dt_s: Length of a step in seconds.
            episode_steps: Steps after which a world's episode ends.
            reset_inactive_fraction: A world's episode ends when this share of its agents is inactive; more than 1: never.
            pedestrian_fraction: Share of pedestrians among the agents.
            cyclist_fraction: Share of cyclists among the agents.
            parked_cars: Parked cars of each world and episode.
            light_cycles: 'phases', lights of a junction take turns, or 'independent', each light cycles alone.
            walls: Whether buildings stand along the roads.
            wall_seed: Draws the heights of walls.
            light_heads: 'as_mapped', or 'visible': heads beside or before their stop line stand 10 m beyond it, 3.5 m high.
            wall_observations: Whether the set `walls` is observed.
            reset_at_standstill: Accelerations end where the speed changes its sign.
            blind: Share of agents that see no other road user for some seconds. Impaired agents are drawn per episode and never valid.
            phantom_braking: Share of agents that brake hard for some seconds.
            inattentive: Share of agents that see no traffic light.
            stagger_episodes: The first episode of each world ends after a drawn number of steps.
            fixed_lights: Lights are green, yellow and red for 10, 3 and 2 s, as in evaluations; else times are drawn per episode.
            auxiliary_observations: Whether auxiliary slots of observations are filled.
            vector_observations: Whether the entity sets are observed.
            conditioning: A number or (low, high) by name of CONDITIONING_NAMES; the paper's ranges otherwise.
            stream: A cudaStream_t as int; None: the legacy default stream.
        
        Raises:
            pictura.UsageError: Names what cannot be simulated.
            pictura.Error: There is no such device.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def _inside(self) -> typing.Any:
        ...
    def check(self) -> None:
        """
        Waits for the work on the stream; raises pictura.Error for errors found by a device.
        """
    def draw(self, world: typing.SupportsInt | typing.SupportsIndex = 0, agent: typing.SupportsInt | typing.SupportsIndex = -1, *, width_px: typing.SupportsInt | typing.SupportsIndex = 640, height_px: typing.SupportsInt | typing.SupportsIndex = 480, width_m: typing.SupportsFloat | typing.SupportsIndex = 150.0) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Draws a world from above, uint8 [height, width, 3], on the CPU. agent: agent of that world in the middle, shown with its
        waypoints; -1 shows the whole map. width_m: width of the shown surroundings.
        """
    def observe(self, queries: typing.Any, hidden: typing.Any = None, inserted: typing.Any = None, *, out: typing.Any = None) -> typing.Any:
        """
        Returns the observations of slots if boxes of their worlds were absent, and other boxes present. Only partners differ; the state
        is unchanged. pictura.make_queries() creates the arguments:
        queries: QUERY_DTYPE [n], or uint8 [n, 24]: a slot, its ranges [begin, end) of the lists `hidden` and `inserted`, and
        leaves_gaps. 0: hidden partners are replaced by boxes that were too far away; 1: rows of zeros replace them.
        hidden: int32 [m], indices into the scene's boxes. inserted: INSERTED_DTYPE [k], or uint8 [k, 40]: a box of BOX_DTYPE and its
        speed_mps. out: arrays of the caller by the names of `observations`, with n in place of the slots; default: new arrays. All
        arrays are in the simulator's memory. Returns out, arrays by name. Raises pictura.Error naming an invalid array or query, and
        then writes nothing; on CUDA queries are checked as in step().
        """
    def reset(self, world_mask: typing.Any = None, seed: typing.SupportsInt | typing.SupportsIndex | None = None) -> None:
        """
        Starts new episodes. world_mask: uint8 or bool [worlds] in the simulator's memory, the worlds to reset; default: all. seed:
        their seed from now on; default: the simulator's own. Raises pictura.Error for another array.
        """
    @typing.overload
    def restore(self, saved: bytes) -> None:
        """
        Restores a saved state. Raises pictura.Error naming the difference.
        """
    @typing.overload
    def restore(self, snapshot: Snapshot) -> None:
        """
        Restores a snapshot of these worlds; on CUDA without waiting.
        """
    def run(self, controller: Controller, steps: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Takes steps with a controller for all agents. ^C ends the call between steps.
        """
    def save(self) -> bytes:
        """
        Returns the complete state as bytes, for exact resume on any executor. Waits for the stream.
        """
    def set_state(self, slots: typing.Any, fields: dict) -> None:
        """
        Sets fields of agents. slots: int32 [n], each once. fields: arrays [n] or [n, per agent] by the names of AGENT_FIELDS, of their
        types, all in the simulator's memory. Lane, height, box, view and observation are updated. Raises pictura.Error naming an
        invalid value; on CUDA values are checked as in step().
        """
    def set_worlds(self, maps: collections.abc.Sequence[Map], worlds: collections.abc.Sequence, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Replaces the worlds by other worlds on other maps, at the start of their first episodes, as in a new simulator. Get the arrays
        again afterwards: previous arrays remain valid memory, which later calls may write. Raises as the constructor does.
        """
    def snapshot(self) -> Snapshot:
        """
        Returns a copy of the state in the simulator's memory.
        """
    def spawn_report(self) -> dict:
        """
        Returns counts by name of requested, spawned, refused, entered and left agents, and of parked cars. Waits for the stream.
        """
    def state_hash(self) -> int:
        """
        Returns 64 bits over the complete state, equal on every executor. Waits for the stream.
        """
    def step(self, actions: typing.Any) -> typing.Any:
        """
        Advances every world by one step. actions: int32 [slots] in the simulator's memory, each in [0, 12): 3 times the index of the
        longitudinal jerk (-15, -4, 0, 4 m/s3) plus the index of the lateral jerk (-4, 0, 4 m/s3, left positive). Actions of inactive
        agents are ignored. A world whose last step ended its episode starts the next one instead, and its slots are not valid. Returns
        the StepResult. Raises pictura.Error, which leaves the state unchanged, for another array and for actions out of range.
        """
    def step_commands(self, commands: typing.Any) -> typing.Any:
        """
        Advances every world by one step with commands, COMMAND_DTYPE [slots]: kind 0 an action, 1 a kinematic state, 2 absence from the
        episode, 3 as recorded, in worlds of a pictura.Scenario. Returns and raises as step() does.
        """
    def time_steps(self, actions: typing.Any, steps: typing.SupportsInt | typing.SupportsIndex) -> float:
        """
        Returns the seconds of this number of steps with the same actions, called from C++, for measurements of Python's overhead in
        step().
        """
    def totals(self) -> dict:
        """
        Returns counts and sums since construction by name; reward_terms is a dict. Waits for the stream.
        """
    @property
    def agent_of_slot(self) -> Array:
        """
        int32 [slots]: the agent's index in its world.
        """
    @property
    def choice(self) -> str:
        """
        Executor selected for 'auto', with the reason.
        """
    @property
    def device(self) -> str:
        ...
    @property
    def dt_s(self) -> float:
        ...
    @property
    def episode_index(self) -> Array:
        """
        int32 [worlds]: the number of the episode.
        """
    @property
    def episode_over(self) -> Array:
        """
        bool [worlds]: the episode has ended, and the next step begins the next one.
        """
    @property
    def episode_step(self) -> Array:
        """
        int32 [worlds]: completed steps in the present episode.
        """
    @property
    def episode_steps(self) -> int:
        ...
    @property
    def geometries(self) -> dict:
        """
        Geometries of its maps, by their handles in the scene.
        """
    @property
    def maps(self) -> list[Map]:
        ...
    @property
    def name(self) -> str:
        ...
    @property
    def num_slots(self) -> int:
        ...
    @property
    def num_worlds(self) -> int:
        ...
    @property
    def observations(self) -> dict:
        """
        Arrays [slots, ...] by name, of the state after the last call: ego, partners, lanes, boundaries, controls, walls, set_counts, conditioning, waypoints.
        """
    @property
    def scene(self) -> Scene:
        """
        Scene of all worlds, for renderers.
        """
    @property
    def seed(self) -> int:
        ...
    @property
    def state(self) -> dict:
        """
        Every field of the agents by name, read-only, [slots] or [slots, per agent].
        """
    @property
    def stream(self) -> int:
        """
        cudaStream_t of the work, as int; 0: the legacy default stream.
        """
    @stream.setter
    def stream(self, arg1: typing.Any) -> None:
        ...
    @property
    def views(self) -> Array:
        """
        One view per slot: uint8 [slots, 60] for render(); its fields are those of VIEW_DTYPE.
        """
    @property
    def world_of_slot(self) -> Array:
        """
        int32 [slots].
        """
    @property
    def worlds(self) -> list[tuple[int, int, int]]:
        """
        (map, agents, global world) of each.
        """
class Recorder:
    """
    Records a world of a simulator on the CPU from now on: every step of the simulator, by any function, as long as the recorder
    lives.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
        >>> recorder = pictura.Recorder(simulator, follow=0)
        >>> simulator.run(pictura.Controller('lane', simulator), 50)
        >>> recorder.write('drive.html')
        >>> recorder.num_steps
        50
    """
    def __init__(self, simulator: typing.Any, *, world: typing.SupportsInt | typing.SupportsIndex = 0, follow: typing.SupportsInt | typing.SupportsIndex = -1, rig: Rig | None = None) -> None:
        """
        follow: agent of that world with which the page opens, and whose decisions are recorded; -1: none. rig: records that agent's
        images at every step, drawn by the CPU renderer, without loss; by default the page draws the paper's cameras itself. Raises
        pictura.UsageError if the world or agent does not exist or the simulator is on a device.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def decide(self, logits: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], value: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        Records a policy's response to the followed agent's state, for the next step: logits [12], and its value.
        """
    def write(self, path: str, policy: str = '') -> None:
        """
        Ends the recording and writes it, completely or not at all: *.html, a page for any browser, or *.mcap, for Foxglove. May be
        called repeatedly. policy: its name in the page. Raises pictura.Error naming the file.
        """
    @property
    def metrics(self) -> dict:
        """
        Counts and sums so far, by name.
        """
    @property
    def num_steps(self) -> int:
        """
        Number of steps and resets so far.
        """
class LiveView:
    """
    Page in the browser that shows the only world of a simulator on the CPU while it runs: pause, step, pace, and drive an agent
    with the keyboard. The simulator's steps then wait until they are due: in real time, or at the page's pace.
    
    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 8)])
        >>> view = pictura.LiveView(simulator, wait_for_page=False)
        >>> view.address.startswith('http://')
        True
        >>> simulator.run(pictura.Controller('lane', simulator), 3)
        >>> view.close()
    """
    def __init__(self, simulator: typing.Any, *, port: typing.SupportsInt | typing.SupportsIndex = 0, host_name: str = '', follow: typing.SupportsInt | typing.SupportsIndex = 0, rig: Rig | None = None, wait_for_page: bool = True) -> None:
        """
        port: of the loopback, 0 for a free one. host_name: if given, listens on all addresses, for pages that address this machine by
        this name. follow: agent with which pages open. rig: cameras of its images; by default pages draw the paper's cameras
        themselves. wait_for_page: waits for the first page before the first step. Raises pictura.UsageError if this package lacks the
        server, pictura.Error if the port is in use.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def close(self) -> None:
        """
        Tells pages that the simulation has ended, and lets the simulator run freely.
        """
    def decide(self, agent: typing.SupportsInt | typing.SupportsIndex, logits: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], value: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        Shows a policy's response to an agent's state while pages follow that agent, until the next call.
        """
    @property
    def address(self) -> str:
        """
        Address of the page, including its secret.
        """
    @property
    def num_pages(self) -> int:
        """
        Number of connected pages.
        """
def _expand_map_names(names: collections.abc.Sequence[str]) -> list[str]:
    """
    Returns the names of maps with every range of generated towns, such as 'procedural:1000-1011', in full.
    """
def _hash64(data: bytes) -> int:
    """
    Returns the FNV-1a hash that ends files of the library.
    """
def _read_rollouts(path: str) -> dict:
    """
    See pictura.realism.read_rollouts().
    """
def _realism_features(scene: Scenario, track_ids: typing.Annotated[numpy.typing.ArrayLike, numpy.int64], center_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], heading_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64]) -> tuple:
    """
    See pictura.realism.features().
    """
def _realism_score(scene: Scenario, track_ids: typing.Annotated[numpy.typing.ArrayLike, numpy.int64], center_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], heading_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], version: str) -> str:
    """
    See pictura.realism.score(): its result as JSON.
    """
def _removed_keys() -> list:
    """
    Returns removed keys of configurations, a tuple each: name, the only valid value, as JSON, and the reason.
    """
def _score_rollouts(path: str, scenes: collections.abc.Sequence[str], version: str, num_threads: typing.SupportsInt | typing.SupportsIndex) -> str:
    """
    See pictura.realism.score_file(): its result as JSON.
    """
def draw_worlds(seed: typing.SupportsInt | typing.SupportsIndex, num_slots: typing.SupportsInt | typing.SupportsIndex, min_agents: typing.SupportsInt | typing.SupportsIndex, max_agents: typing.SupportsInt | typing.SupportsIndex, num_maps: typing.SupportsInt | typing.SupportsIndex) -> list[tuple[int, int, int]]:
    """
    Draws worlds of sizes from U{min, max} until they fill the slots; they use the maps in turn.
    
    Examples:
        >>> worlds = pictura.draw_worlds(seed=1, num_slots=100, min_agents=5, max_agents=40, num_maps=2)
        >>> sum(agents for _, agents, _ in worlds)
        100
    """
def known_towns() -> list[str]:
    """
    Returns the names of the towns in the map folder, sorted.
    
    Examples:
        >>> pictura.known_towns()      # doctest: +SKIP
        ['Town01', 'Town02', 'Town03']
    """
def make_views(origin_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], heading_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], *, world: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, ego_agent: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, body_length_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float32] | None = None) -> numpy.ndarray[typing.Any, numpy.dtype[typing.Any]]:
    """
    Returns poses of a rig, a NumPy array of VIEW_DTYPE [n].
    
    origin_m [n, 3]: origin of the rig, on the ground. heading_rad [n]. world [n]: default: 0. ego_agent [n]: box of the scene that
    is left out, -1 for none. body_length_m [n]: bodies shorter than 4.5 m move cameras nearer to their origin. Raises
    pictura.Error for other shapes.
    
    Examples:
        >>> pictura.make_views(origin_m=[[0, 0, 0], [5, 0, 0]], heading_rad=[0, 1.5]).shape
        (2,)
    """
def map_folder() -> str:
    """
    Returns the folder of towns: $PICTURA_DATA, or the user's data folder.
    
    Examples:
        >>> isinstance(pictura.map_folder(), str)
        True
    """
def renderer_names() -> list[str]:
    """
    Returns the renderers of this build.
    
    Examples:
        >>> 'cpu' in pictura.renderer_names()
        True
    """
def simulator_names() -> list[str]:
    """
    Returns the executors of this build.
    
    Examples:
        >>> 'cpu' in pictura.simulator_names()
        True
    """
def write_gallery(folder: str) -> int:
    """
    Writes FOLDER/index.html over the replays in the folder, worst first, and returns their number. Raises pictura.Error naming a
    page that is no replay.
    
    Examples:
        >>> pictura.write_gallery('replays')            # doctest: +SKIP
        4
    """
AGENT_FIELDS: tuple = (('x_m', 'f32', 1, False, 'rear axle, or the centre of a pedestrian'), ('y_m', 'f32', 1, False, ''), ('z_m', 'f32', 1, False, 'height of the road under it'), ('heading_rad', 'f32', 1, False, 'counter-clockwise from x, in [-pi, pi]'), ('cos_heading', 'f32', 1, True, ''), ('sin_heading', 'f32', 1, True, ''), ('speed_mps', 'f32', 1, False, 'signed, along the heading'), ('accel_long_mps2', 'f32', 1, False, ''), ('accel_lat_mps2', 'f32', 1, False, 'positive to the left'), ('steer_rad', 'f32', 1, False, 'front wheel angle, positive to the left'), ('jerk_long_mps3', 'f32', 1, False, 'realised in the last step'), ('jerk_lat_mps3', 'f32', 1, False, ''), ('length_m', 'f32', 1, False, 'of the box'), ('width_m', 'f32', 1, False, ''), ('height_m', 'f32', 1, False, ''), ('lane', 'i32', 1, True, 'current lane, -1 none'), ('lane_offset_m', 'f32', 1, True, 'signed, positive to the left of the centre line'), ('lane_angle_rad', 'f32', 1, True, "heading less the lane's direction, in [-pi, pi]"), ('speed_limit_mps', 'f32', 1, True, 'of the current lane'), ('waypoint_x_m', 'f32', 3, False, 'the goal chain; passed ones stay until the chain is renewed'), ('waypoint_y_m', 'f32', 3, False, ''), ('waypoint_z_m', 'f32', 3, False, ''), ('next_waypoint', 'i32', 1, False, 'index of the active one, in [0, 3)'), ('goal_lane', 'i32', 1, False, 'lane (or piece of a walkway) of the last waypoint, where the next chain starts'), ('goal_lane_s_m', 'f32', 1, False, 'arc length of the last waypoint on it'), ('goal_chains', 'i32', 1, False, 'chains drawn in this episode'), ('goal_x_m', 'f32', 1, False, 'last waypoint that the metric Goals waits for, see rules/step.h'), ('goal_y_m', 'f32', 1, False, ''), ('goal_z_m', 'f32', 1, False, ''), ('goal_open', 'u8', 1, False, '1 while the metric waits for it'), ('conditioning', 'f32', 17, False, 'reward coefficients and dynamics multipliers; see simulator/conditioning.h'), ('agent_class', 'u8', 1, False, 'AgentClass'), ('status', 'u8', 1, False, 'AgentStatus'), ('refusal', 'u8', 1, True, 'SpawnFailure, of an absent agent'), ('halt_reason', 'u8', 1, False, 'Event bits that halted it'), ('events', 'u8', 1, False, 'Event bits of the last step'), ('goals_reached', 'i32', 1, False, 'last waypoints passed within 2 m in this episode'), ('waypoints_reached', 'i32', 1, False, 'waypoints of any kind, passed or rewarded in this episode'), ('distance_m', 'f32', 1, False, 'sum of |speed| dt in this episode'), ('first_motion_step', 'i32', 1, False, 'first step of this episode above kRest_mps, from 1; 0: none yet'), ('episode_events', 'u8', 1, False, "union of the episode's event bits"), ('episode_return', 'f32', 1, False, 'sum of rewards in this episode'), ('life', 'i32', 1, True, 'number of earlier lives in this episode'), ('life_step', 'i32', 1, True, 'step of this episode at which the life began'), ('left', 'u8', 1, True, '1: it left in the last step'))
BOX_DTYPE: numpy.dtypes.VoidDType
COMMAND_DTYPE: numpy.dtypes.VoidDType
CONDITIONING_NAMES: tuple = ('delta_goal_m', 'v_goal_mps', 'collision', 'off_road', 'stop_line', 'comfort', 'lane_align', 'vel_align', 'lane_center', 'center_bias_m', 'velocity', 'reverse', 'overspeed', 'timestep', 'throttle', 'steer', 'acceleration')
EVENTS: dict = {'collision': 1, 'at_fault': 2, 'off_road': 4, 'red_light': 8, 'wall': 16, 'goal': 32, 'waypoint': 64, 'metric_goal': 128}
EVENT_TOTALS: dict = {'goals_reached': 128, 'waypoints_reached': 96, 'collisions': 1, 'at_fault_collisions': 2, 'off_road': 4, 'red_light': 8, 'wall_contacts': 16}
HAS_CUDA: bool = True
IDLE_ACTION: int = 7
INFRACTIONS: int = 29
INSERTED_DTYPE: numpy.dtypes.VoidDType
LANE_TYPES: tuple = ('driving', 'bidirectional', 'parking', 'ramp', 'shoulder', 'sidewalk', 'biking', 'median', 'border', 'stop', 'restricted', 'other')
LIGHT_STATES: tuple = ('none', 'arrow_stop', 'arrow_caution', 'arrow_go', 'stop', 'caution', 'go', 'flashing_stop', 'flashing_caution')
LINE_TYPES: tuple = ('unknown', 'broken_single_white', 'solid_single_white', 'solid_double_white', 'broken_single_yellow', 'broken_double_yellow', 'solid_single_yellow', 'solid_double_yellow', 'passing_double_yellow', 'dash_white', 'dash_yellow')
NUM_ACTIONS: int = 12
OBSERVATION_ARRAYS: tuple = (('ego', 'f32', 1, 9), ('partners', 'f32', 16, 8), ('lanes', 'f32', 80, 7), ('boundaries', 'f32', 80, 7), ('controls', 'f32', 10, 7), ('walls', 'f32', 80, 7), ('set_counts', 'i32', 1, 5), ('conditioning', 'f32', 1, 17), ('waypoints', 'f32', 3, 3))
QUERY_DTYPE: numpy.dtypes.VoidDType
REALISM_VERSIONS: tuple = ('2024', '2025')
REWARD_TERMS: tuple = ('goal', 'collision', 'off_road', 'stop_line', 'comfort', 'lane_align', 'lane_center', 'velocity', 'overspeed', 'reverse', 'timestep')
TRACK_TYPES: tuple = ('unset', 'vehicle', 'pedestrian', 'cyclist', 'other')
VIEW_DTYPE: numpy.dtypes.VoidDType
__version__: str = '0.2.0'
