"""
The pictura library: maps, scenes, renderers and simulators. Import these names from `pictura`.
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
    A call failed. The message names the expected and the actual value.
    """
class UsageError(Error, ValueError):
    """
    Invalid usage: an argument does not exist, has an invalid value, or conflicts with other arguments.
    """
class Array:
    """
    Array in the library's memory, lent without a copy.
    
    On the CPU, `numpy.asarray(array)` returns a NumPy view. On any device, DLPack gives access: `torch.from_dlpack`,
    `numpy.from_dlpack`, JAX and CuPy. The memory remains allocated while any reference to it exists, even after its
    simulator or renderer is deleted. Later calls of the simulator or renderer change the contents.
    
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
        Returns a DLPack capsule, versioned if max_version is (1, 0) or later. Raises BufferError if the array cannot be exported.
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
        Returns a torch tensor that shares the memory. Imports torch.
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
        Lengths of the dimensions, a tuple of int.
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
        
        lines: list of (points [n, 3] in metres, width in metres, RGB colour with values in [0, 1]).
        walls: float [n, 7]: both ends of a wall on the ground (x, y, z, x, y, z) and its height, in metres.
        Raises pictura.Error for other shapes. Renderers reject numbers that are not finite.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    @property
    def num_lights(self) -> int:
        """
        Number of traffic light states in each world with this geometry.
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
    Road network: lanes, markings, edges and traffic lights. A map is immutable, so simulators and renderers can share it.
    
    Positions are in metres in the map's frame, with z up. `origin_m` is the origin of this frame in the file's coordinates.
    
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
        Parses the text of an OpenDRIVE file. source: name of the text in error messages. Raises the same errors as load().
        """
    @staticmethod
    def load(name: str, *, strict: bool = False, chord_error_m: typing.SupportsFloat | typing.SupportsIndex = 0.019999999552965164) -> Map:
        """
        Loads or generates a map by name: an OpenDRIVE file (.xodr), a Lanelet2 file (.osm), a town in the folder map_folder(),
        'procedural:SEED', or 'city:SEED'. For FILE.osm@LATITUDE,LONGITUDE this place is the origin of coordinates.
        
        Faults of a file that have only one sensible repair are repaired, and listed in `mends`.
        strict: rejects files with such faults instead.
        chord_error_m: maximum distance in metres between a curve and the polyline that approximates it.
        Raises pictura.Error, which names file, line and element, for an invalid file, and pictura.UsageError if the map does
        not exist.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def __repr__(self) -> str:
        ...
    def arrays(self) -> dict:
        """
        Returns copies of the network's geometry as a dict of NumPy arrays. Lengths are in metres.
        
        lane_points float32 [points, 6]: x, y, z, heading in radians, width, arc length. lane_point_range int32 [lanes, 2]: the
        half-open range of each lane's points. lane_type uint8 [lanes]: indices into pictura.LANE_TYPES. lane_links int32:
        successors and predecessors of all lanes. road_edges, stop_lines, building_lines float32 [n, 6]: both ends of each
        segment.
        """
    def draw(self, width_px: typing.SupportsInt | typing.SupportsIndex = 1024, height_px: typing.SupportsInt | typing.SupportsIndex = 1024) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Draws the map from above. Returns uint8 [height, width, 3], with north at the top. Sizes are from 16 to 8192 px.
        """
    def geometry(self, walls: bool = True, wall_seed: typing.SupportsInt | typing.SupportsIndex = 0, light_heads: str = 'as_mapped') -> Geometry:
        """
        Returns the map's geometry for renderers. walls: adds walls along the building lines; wall_seed is the random seed of
        their heights. light_heads: as for Simulator.
        """
    @property
    def facts(self) -> dict:
        """
        Dict of counts and lengths, as `pictura map` prints them.
        """
    @property
    def geo_reference(self) -> str:
        """
        PROJ string of the file's coordinates; may be empty.
        """
    @property
    def mends(self) -> list[tuple[str, str, str]]:
        """
        Repaired faults of the file, a tuple (kind, repair, message) for each.
        """
    @property
    def name(self) -> str:
        """
        Name of the map: 'Town01', 'procedural:7', or the file's stem.
        """
    @property
    def origin_m(self) -> typing.Annotated[list[float], "FixedSize(3)"]:
        """
        The map's origin in the file's coordinates, three floats in metres.
        """
class Scenario(Map):
    """
    Recorded scene: a map, the tracks of all road users, and the recorded traffic lights. A scenario is immutable.
    
    A simulator uses a scenario as the map of a world. The agents of this world are the tracks, in the same order, from
    `start_step` on: pictura.Simulator([scene], [(0, scene.num_tracks)], **scene.world()). The controller 'log' and commands
    of kind 3 replay the tracks.
    
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
        Creates a scene from dicts of NumPy arrays, or of objects that NumPy converts to arrays.
        
        Lengths are in metres. Positions are float64 in any frame. Polylines are given by two arrays: points float64 [P, 3], the
        points of all polylines one after the other, and begin int32 [N + 1], the index of each polyline's first point, followed
        by P. Lists of ids are given in the same way, for example by lanes and lanes_begin.
        
        Args:
            tracks: id int64 [T]; type [T], indices into pictura.TRACK_TYPES; size_m [T, 3], length, width and height; valid
                bool [T, S]; position_m [T, S, 3], centre of the box's foot; heading_rad [T, S]; velocity_mps [T, S, 2]. States
                that are not valid may contain any numbers.
            lanes: points and begin of centre lines; id int64 [N], 0 or more; type [N], indices into pictura.LANE_TYPES.
                Optional: speed_limit_mps [N], 0 if unknown; width_m [P], all 0 along a lane of unknown width; in_junction bool
                [N]; entries and exits, ids of linked lanes, with entries_begin and exits_begin [N + 1]; left_neighbor and
                right_neighbor [N], ids of lanes of the same direction, or -1. Without entries and exits, lanes are linked where
                their ends coincide.
            lines: points, begin, and type [N], indices into pictura.LINE_TYPES.
            edges: points and begin of road edges, with the road on their left.
            crosswalks: points and begin of outlines.
            stop_signs: position_m [N, 3]; lanes, ids of the controlled lanes, with lanes_begin [N + 1].
            lights: lanes, ids of the controlled lanes, with lanes_begin [L + 1]; states [L, S], indices into
                pictura.LIGHT_STATES; stop_lines [L, 2, 3], by default across the beginning of the lanes.
            dt_s: Time between states in seconds.
            current_step: Step of the present, at which the history ends. None: 10, or the last step if there are fewer.
            sdc_track: Index of the self-driving car's track.
            id: Id of the scene.
            origin_m: Origin of the map's frame, in which positions are rounded to float32. None: the middle of lanes and edges.
            tolerance_m: Maximum deviation of polylines when points are removed. 0 keeps all points.
        
        Raises:
            pictura.UsageError: An array is invalid; the message names the array and the element.
            pictura.Error: The arrays do not form a scene.
        """
    @staticmethod
    def load(name: str, *, start_step: typing.SupportsInt | typing.SupportsIndex = 0) -> Scenario:
        """
        Loads a scene by name: FILE.json, FILE.bin, FILE.scenario, a file with '.tfrecord' in its name, or a folder of such
        files. A suffix '#7' or '#SCENARIO_ID' selects one of several scenes.
        
        start_step: step of the recording at which episodes begin.
        Raises pictura.Error, which names file, record and field, and pictura.UsageError if the scene or step does not exist.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def __repr__(self) -> str:
        ...
    def draw(self, width_px: typing.SupportsInt | typing.SupportsIndex = 1024, height_px: typing.SupportsInt | typing.SupportsIndex = 1024) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Draws the scene from above: the paths of all tracks, and the road users at start_step.
        
        Returns uint8 [height, width, 3], with north at the top. Sizes are from 16 to 8192 px.
        """
    def inverse_actions(self, num_threads: typing.SupportsInt | typing.SupportsIndex = 0) -> dict:
        """
        Computes the actions with which the simulator's dynamics follow the recording most closely. Returns a dict of
        NumPy arrays.
        
        The arrays are [tracks, steps from start_step on], with a value for the step after each state. actions int32: the
        action. is_followed bool: whether the states before and after the step are recorded. error_m float32: distance between
        the simulated and the recorded position after the step.
        num_threads: number of CPU threads; 0: all.
        """
    def mask(self, words: str, *, absent: bool = False) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Returns a mask uint8 [tracks], which is 1 for selected tracks.
        
        words: comma-separated list of self (the self-driving car), vehicles (all other vehicles), others (all non-vehicles),
        all, tracks_to_predict, objects_of_interest, and ids of tracks.
        absent: also selects tracks that are absent at start_step.
        Raises pictura.UsageError for an unknown word, and if no track is selected.
        """
    def save(self, path: str) -> None:
        """
        Writes the scene to a file *.scenario, completely or not at all. load() restores exactly the same scene.
        
        Raises pictura.UsageError for another file extension, and pictura.Error if the file cannot be written.
        """
    def starting_at(self, start_step: typing.SupportsInt | typing.SupportsIndex) -> Scenario:
        """
        Returns the same scene with another start step, without copying data.
        
        Raises pictura.UsageError if the scene does not have this step.
        """
    def to_arrays(self) -> dict:
        """
        Returns a dict of arguments with which pictura.Scenario.from_arrays(**arrays) creates the same scene.
        
        The result does not contain tracks to predict, tracks marked for replay, walls, parking spaces, signs other than stop
        signs, widths of paint, and the data for bit-exact replay of a saved run.
        """
    def tracks(self) -> dict:
        """
        Returns copies of the tracks as a dict of NumPy arrays.
        
        id int64 [tracks]: ids in the file. type uint8 [tracks]: indices into pictura.TRACK_TYPES. size_m float32 [tracks, 3]:
        length, width, height. valid bool [tracks, steps]: whether the state is recorded. position_m float32 [tracks, steps, 3]:
        centre of the box's foot in the map's frame. heading_rad [tracks, steps]. velocity_mps [tracks, steps, 2]: 0 if
        the state is not valid.
        """
    def with_recorded_lights(self) -> Scenario:
        """
        Returns the same scene with its recorded lights enabled: worlds draw and observe them, and crossing a red light is an infraction.
        """
    def world(self, **kwargs) -> dict:
        """
        Returns the options for pictura.Simulator([scene], worlds, **options): the recording's time step, episodes from
        start_step to the end of the recording, no walls, no parked cars, no early end of episodes, and unscaled dynamics.
        
        Other options in kwargs are kept, for example those of a pictura.PolicySession: scene.world(**session.training_world()).
        """
    @property
    def current_step(self) -> int:
        """
        Step of the present: the last step of the history that a predictor may use.
        """
    @property
    def dt_s(self) -> float:
        """
        Seconds between states.
        """
    @property
    def facts(self) -> dict:
        """
        Dict of the map's counts and lengths, and of counts of tracks and lights, as `pictura map` prints them.
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
        Elements that the conversion of the file dropped or changed: a tuple (kind, count, place of the first) for each kind.
        """
    @property
    def num_steps(self) -> int:
        """
        Number of states of each track, from the recording's first step on.
        """
    @property
    def num_tracks(self) -> int:
        """
        Number of tracks, and of agents in each of the scene's worlds.
        """
    @property
    def sdc_track(self) -> int | None:
        """
        Index of the self-driving car's track; None if the file does not mark it.
        """
    @property
    def start_step(self) -> int:
        """
        Step of the recording at which episodes begin.
        """
class SceneRecorder:
    """
    Records the current episode of one world as a scene. The simulator must be on the CPU. While the recorder exists, it
    records every step of the simulator, by any function.
    
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
        Raises pictura.UsageError if the world does not exist or the simulator is on CUDA.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def scenario(self, *, id: str = '', self_agent: typing.SupportsInt | typing.SupportsIndex = -1) -> Scenario:
        """
        Returns the pictura.Scenario recorded so far. Its tracks are the controlled agents and the parked cars of the world; a
        track's id is the index of its box in the world. The world's lights are its recorded lights.
        
        self_agent: agent whose track is marked as the self-driving car; -1: none. Raises pictura.UsageError for an agent that
        was never present.
        """
    @property
    def num_steps(self) -> int:
        """
        Number of recorded steps.
        """
class Camera:
    """
    Pinhole camera on a body. Its position is in metres from the rig's origin: x forward, y left, z up. Angles are in
    radians. Positive yaw is counter-clockwise, positive pitch looks up, and positive roll is clockwise as seen from behind.
    
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
        The principal point is the middle of the image. The default of focal_px is 0.8 times the width, a horizontal field of view of about 64 degrees.
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
    One or more cameras on a body, in the order of their images. Cameras may have different image sizes.
    
    Examples:
        >>> [camera.name for camera in pictura.Rig.paper(96, 54).cameras]
        ['front', 'front_left', 'front_right', 'back']
        >>> len(pictura.Rig([pictura.Camera('front', 64, 36, position_m=(1.5, 0, 1.4))]))
        1
    """
    @staticmethod
    def load(path: str) -> Rig:
        """
        Reads a rig from a TOML file. Raises pictura.Error, which names file, camera and key.
        """
    @staticmethod
    def paper(width_px: typing.SupportsInt | typing.SupportsIndex = 96, height_px: typing.SupportsInt | typing.SupportsIndex = 54, square_pixels: bool = False) -> Rig:
        """
        Returns the paper's four cameras: front, front left, front right and back. Image sizes are from 1 to 8192 px.
        """
    def __getstate__(self) -> tuple[list[Camera]]:
        ...
    def __init__(self, cameras: collections.abc.Sequence[Camera]) -> None:
        """
        Creates a rig of 1 to 64 cameras. Raises pictura.Error for another number or an invalid camera.
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
    Dynamic objects of one or more worlds: boxes of agents and states of traffic lights. Simulator.scene always shows the
    simulator's current state. A scene created from arrays has a copy of them.
    
    Examples:
        >>> car = pictura.Scene(center_m=[[12, 0, 0]], heading_rad=[0], size_m=[[4.4, 1.8, 1.5]], agent_class=[0])
        >>> car.num_worlds, car.boxes.shape
        (1, (1, 36))
    """
    def __init__(self, center_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], heading_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], size_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], agent_class: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], *, world_begin: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, geometry: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, light_states: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None, light_begin: typing.Annotated[numpy.typing.ArrayLike, numpy.int32] | None = None) -> None:
        """
        Creates a scene from arrays.
        
        Args:
            center_m: [n, 3], centres of the boxes' feet, in metres.
            heading_rad: [n], headings in radians.
            size_m: [n, 3], length, width and height of boxes, in metres.
            agent_class: [n], 0 vehicle, 1 cyclist, 2 pedestrian.
            world_begin: [worlds + 1], index of the first box of each world, followed by n; default: a single world.
            geometry: [worlds], handle of each world's geometry, as in Renderer.upload(); default: 0.
            light_states: States of the lights of all worlds: 0 off, 1 red, 2 yellow, 3 green, 4 unknown.
            light_begin: [worlds + 1], index of the first light of each world, followed by the number of lights.
        
        Raises:
            pictura.Error: An array has another shape. Inconsistent arrays raise the error later, in render().
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    @property
    def boxes(self) -> Array:
        """
        Boxes, read-only, uint8 [boxes, 36]. `numpy.asarray(boxes).view(BOX_DTYPE)[:, 0]` has the fields by name.
        """
    @property
    def num_worlds(self) -> int:
        """
        Number of worlds.
        """
class SceneFile:
    """
    Scene in a TOML file: geometry, boxes, rig and views.
    
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
        Reads a scene file. Raises pictura.Error, which names file, line, table and key.
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
        Scene of one world, whose geometry has the handle 0.
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
    Images of several views by all cameras of a rig, in the renderer's memory. They may have planes: depth, class and
    instance of each pixel. A renderer can draw into the same images repeatedly.
    
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
        Returns the images of one camera, [views, 3, height, width].
        """
    def planes(self, camera: typing.SupportsInt | typing.SupportsIndex) -> dict:
        """
        Returns planes [views, height, width], which describe the visible surface at each pixel's centre: depth_m float32
        (infinite if there is no surface), class_id uint8 (0: none), instance_id uint16 (1 + the agent's index in its world; 0:
        no agent). Raises pictura.Error for images without planes.
        """
    @property
    def blocks(self) -> list:
        """
        Arrays [views, cameras, 3, height, width], one for the cameras of each image size.
        """
    @property
    def num_views(self) -> int:
        """
        Number of views for which memory is allocated.
        """
    @property
    def rgb(self) -> Array:
        """
        [views, cameras, 3, height, width], for a rig whose cameras have the same image size.
        """
class _RendererInside:
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
class Renderer:
    """
    Renderer of scenes. Only one thread at a time may use a renderer; different renderers are independent. On CUDA, work is
    enqueued on `stream`.
    
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
        Creates a renderer.
        
        Args:
            name: 'cpu', 'cuda', 'gl' ('gl:egl', 'gl:osmesa'), 'null', or 'auto'.
            rig: Cameras; default: the paper's rig.
            device: Memory of scenes, views and images: 'cpu' or 'cuda:0'.
            num_threads: Number of CPU threads; 0: all.
            line_floor_px: Minimum width of a line in images, in pixels.
            debug_palette: Whether halted and parked agents have other colours.
            samples: For 'gl': '4' (MSAA) or '4x4' (supersampling).
            camera_severity: Severity of randomized cameras, 0 to 2, as in evaluations (docs/explanation/cameras.md). The field
                `key` of a view, which a simulator sets, keys the random numbers.
            stream: A cudaStream_t as int; None: the legacy default stream.
        
        Raises:
            pictura.UsageError: The name is unknown; the message lists the valid names.
            pictura.Error: The renderer cannot run on this machine.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def _inside(self) -> _RendererInside:
        ...
    def check(self) -> None:
        """
        Waits for the work on the stream. Raises pictura.Error for errors that CUDA kernels have found.
        """
    def make_images(self, num_views: typing.SupportsInt | typing.SupportsIndex, *, dtype: str = 'uint8', planes: bool = False) -> Images:
        """
        Allocates images for num_views views. dtype: 'uint8' has values from 0 to 255; 'float32' and 'float16', which some renderers lack, have values from 0 to 1. planes: whether depth, class and instance are drawn too.
        """
    def render(self, scene: Scene, views: typing.Any, out: typing.Any = None, *, dtype: str = 'uint8', planes: bool = False) -> typing.Any:
        """
        Draws the images of every camera for every view. Returns `out`.
        
        views: VIEW_DTYPE [n], or Simulator.views.
        out: Images, or an array [n, cameras, 3, height, width] in the renderer's memory (NumPy, torch, ...) if all cameras have
        the same image size. Its type is uint8 or bfloat16, with values from 0 to 255, or float32 or float16, with values from 0
        to 1. Default: new Images with `dtype` and `planes`.
        On CUDA the call returns when the work is enqueued. On the CPU, ^C ends the call between two views. Raises
        pictura.Error, which names an invalid array.
        """
    def upload(self, handle: typing.SupportsInt | typing.SupportsIndex, geometry: Geometry) -> None:
        """
        Copies a geometry to the renderer. Scenes refer to it by `handle`, 0 to 65535. Raises pictura.Error if the geometry is invalid.
        """
    def visibility(self, scene: Scene, views: typing.Any, queries: typing.Annotated[numpy.typing.ArrayLike, numpy.int32]) -> numpy.typing.NDArray[numpy.float32]:
        """
        Returns the visibility of agents, float32 [n].
        
        queries: int [n, 2], pairs of (index of the view, index of the box in the scene).
        A visibility is the area that the box covers in the view's images, divided by the area that it covers if it is drawn
        alone. It is NaN if the box is outside the images of all cameras.
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
        The cudaStream_t on which work is enqueued, as int; 0: the legacy default stream.
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
        float32 [slots]: reward of this step.
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
        bool [slots]: the episode ended for another reason, so learning must bootstrap from the last observation's value.
        """
    @property
    def valid(self) -> typing.Any:
        """
        bool [slots]: the agent was active when the step began, so training may use the transition.
        """
class Snapshot:
    """
    Copy of a simulator's state in the simulator's memory, from Simulator.snapshot().
    
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
    Controller of the agents in one simulator on the CPU.
    
    Controllers by name are 'lane' (follows lanes), 'idm_lanes' (follows lanes and keeps a distance to vehicles ahead),
    'idle' and 'random', and in recorded scenes 'log', 'inverse' and 'idm'. pictura.PolicySession makes controllers with a
    policy; shared() combines several controllers.
    
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
        Returns a controller that combines several controllers, each for some of a simulator's slots.
        
        drivers: pairs (controller, mask). If two controllers command the same slot, the later one in the list drives.
        mask: uint8 or bool [slots] in the simulator's memory, which every step reads; None: all slots.
        Raises pictura.Error for a mask of another shape, type or device, and for a controller of another simulator.
        """
    def __init__(self, name: str, simulator: Simulator, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Raises pictura.UsageError, which lists the valid names, if `name` is unknown.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def act(self, simulator: Simulator) -> typing.Any:
        """
        Returns commands for all slots: a NumPy array of COMMAND_DTYPE [slots], or uint8 [slots, 28] on CUDA. The caller may
        change them before step_commands() executes them. Every call returns the same memory.
        """
    @property
    def name(self) -> str:
        ...
class Simulator:
    """
    Many worlds, each on one map, which advance together. Arrays have one element for each slot: first for the controlled
    agents of world 0, then for the controlled agents of world 1, and so on. Results of the executors 'cpu' and 'cuda' are
    equal bit for bit.
    
    Only one thread at a time may use a simulator; different simulators are independent. The GIL is released while C++ code
    runs. On CUDA, work is enqueued on `stream`, and calls return before the work is done. Invalid values then raise an
    error in check() or a later call.
    
    Examples:
        >>> town = pictura.Map.load('procedural:3')
        >>> simulator = pictura.Simulator([town], [(0, 16)] * 4, seed=1)          # four worlds of sixteen agents
        >>> result = simulator.step(np.full(simulator.num_slots, pictura.IDLE_ACTION, np.int32))
        >>> result.reward.numpy().shape, simulator.observations['lanes'].numpy().shape
        ((64,), (64, 80, 7))
    """
    def __init__(self, maps: collections.abc.Sequence[Map], worlds: collections.abc.Sequence, *, executor: str = 'auto', device: str = 'cpu', seed: typing.SupportsInt | typing.SupportsIndex = 0, num_threads: typing.SupportsInt | typing.SupportsIndex = 0, dt_s: typing.SupportsFloat | typing.SupportsIndex = 0.10000000149011612, episode_steps: typing.SupportsInt | typing.SupportsIndex = 1280, reset_inactive_fraction: typing.SupportsFloat | typing.SupportsIndex = 0.4000000059604645, pedestrian_fraction: typing.SupportsFloat | typing.SupportsIndex = 0.10000000149011612, cyclist_fraction: typing.SupportsFloat | typing.SupportsIndex = 0.10000000149011612, parked_cars: typing.SupportsInt | typing.SupportsIndex = 32, light_cycles: str = 'phases', walls: bool = True, wall_seed: typing.SupportsInt | typing.SupportsIndex = 0, light_heads: str = 'as_mapped', wall_observations: bool = False, reset_at_standstill: bool = False, blind: typing.SupportsFloat | typing.SupportsIndex = 0.0, phantom_braking: typing.SupportsFloat | typing.SupportsIndex = 0.0, inattentive: typing.SupportsFloat | typing.SupportsIndex = 0.0, stagger_episodes: bool = False, fixed_lights: bool = False, auxiliary_observations: bool = True, vector_observations: bool = True, conditioning: dict = {}, stream: typing.Any = None) -> None:
        """
        Creates a simulator with worlds at the start of their first episodes. Defaults are the paper's training world.
        
        Args:
            maps: Maps of the worlds.
            worlds: A tuple (index of the map, number of agents) or (index, number, global world) for each world. The global
                world, an int, keys the world's random numbers.
            executor: 'cpu', 'cuda' or 'auto'.
            device: Memory of observations and scenes: 'cpu', 'cuda' or 'cuda:INDEX'.
            seed: Seed of all random numbers.
            num_threads: Number of CPU threads; 0: all.
            dt_s: Length of a step in seconds.
            episode_steps: Steps after which a world's episode ends.
            reset_inactive_fraction: A world's episode ends when this share of its agents is inactive; a value over 1 disables
                this.
            pedestrian_fraction: Share of pedestrians among the agents.
            cyclist_fraction: Share of cyclists among the agents.
            parked_cars: Number of parked cars in each world.
            light_cycles: 'phases': lights of a junction take turns. 'independent': each light has its own cycle.
            walls: Whether buildings stand along the roads.
            wall_seed: Random seed of the heights of walls.
            light_heads: Positions of light heads. 'as_mapped': as in the map. 'visible': heads beside or before their stop line
                are moved 10 m beyond it, 3.5 m high.
            wall_observations: Whether the entity set `walls` is observed.
            reset_at_standstill: Whether accelerations become 0 when the speed changes its sign.
            blind: Share of agents that see no other road users for some seconds. These and the next two kinds of impaired
                agents are drawn at random in each episode; their transitions are never valid.
            phantom_braking: Share of agents that brake hard for some seconds without a reason.
            inattentive: Share of agents that see no traffic lights.
            stagger_episodes: Whether episodes end after a random number of steps, so that worlds do not end together.
            fixed_lights: Whether lights are green, yellow and red for 10, 3 and 2 s, as in evaluations. Otherwise durations are
                random in each episode.
            auxiliary_observations: Whether auxiliary numbers, which no image shows, are observed.
            vector_observations: Whether the entity sets are observed.
            conditioning: A number or a range (low, high) for names in CONDITIONING_NAMES; other names have the paper's ranges.
            stream: A cudaStream_t as int; None: the legacy default stream.
        
        Raises:
            pictura.UsageError: An argument is invalid; the message names it.
            pictura.Error: The device does not exist.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def _inside(self) -> typing.Any:
        ...
    def check(self) -> None:
        """
        Waits for the work on the stream. Raises pictura.Error for errors that CUDA kernels have found.
        """
    def draw(self, world: typing.SupportsInt | typing.SupportsIndex = 0, agent: typing.SupportsInt | typing.SupportsIndex = -1, *, width_px: typing.SupportsInt | typing.SupportsIndex = 640, height_px: typing.SupportsInt | typing.SupportsIndex = 480, width_m: typing.SupportsFloat | typing.SupportsIndex = 150.0) -> numpy.typing.NDArray[numpy.uint8]:
        """
        Draws a world from above on the CPU. Returns uint8 [height, width, 3]. agent: agent of this world in the middle, with
        its waypoints; -1: the whole map. width_m: width of the drawn area in metres, if there is an agent.
        """
    def observe(self, queries: typing.Any, hidden: typing.Any = None, inserted: typing.Any = None, *, out: typing.Any = None) -> typing.Any:
        """
        Returns hypothetical observations, in which some boxes of the world are hidden and other boxes are inserted. Only the
        entity set `partners` differs from the actual observation. The state is unchanged. pictura.make_queries() creates the
        first three arguments. All arrays must be in the simulator's memory.
        
        queries: QUERY_DTYPE [n], or uint8 [n, 24]: for each query the observing slot, its ranges [begin, end) in `hidden` and
        `inserted`, and leaves_gaps. If leaves_gaps is 0, boxes further away replace hidden partners; if it is 1, rows of zeros
        replace them.
        hidden: int32 [m], indices into the scene's boxes.
        inserted: INSERTED_DTYPE [k], or uint8 [k, 40]: a box of BOX_DTYPE and its speed_mps.
        out: arrays [n, ...] for the results, with the names of `observations`; default: new arrays.
        Returns out. Raises pictura.Error, which names an invalid array or query; then nothing is written. On CUDA, invalid
        queries raise the error in check() or a later call.
        """
    def reset(self, world_mask: typing.Any = None, seed: typing.SupportsInt | typing.SupportsIndex | None = None) -> None:
        """
        Starts new episodes.
        
        world_mask: uint8 or bool [worlds] in the simulator's memory, true for worlds to reset; default: all worlds.
        seed: seed of these worlds from now on; default: the simulator's seed.
        Raises pictura.Error for a mask of another shape, type or device.
        """
    @typing.overload
    def restore(self, saved: bytes) -> None:
        """
        Restores a state of save(). Raises pictura.Error if the state is of other worlds; the message names the difference.
        """
    @typing.overload
    def restore(self, snapshot: Snapshot) -> None:
        """
        Restores a snapshot of these worlds. On CUDA it does not wait for the stream.
        """
    def run(self, controller: Controller, steps: typing.SupportsInt | typing.SupportsIndex) -> None:
        """
        Advances every world by `steps` steps, with a controller for all agents. ^C ends the call between two steps.
        """
    def save(self) -> bytes:
        """
        Returns the complete state as bytes, from which any executor can resume exactly. Waits for the stream.
        """
    def set_state(self, slots: typing.Any, fields: dict) -> None:
        """
        Sets fields of agents, and updates their lanes, heights, boxes, views and observations.
        
        slots: int32 [n], without duplicates. fields: arrays [n] or [n, numbers per agent], with names and types of
        AGENT_FIELDS. All arrays must be in the simulator's memory. Raises pictura.Error, which names an invalid value. On CUDA,
        invalid values raise the error in check() or a later call.
        """
    def set_worlds(self, maps: collections.abc.Sequence[Map], worlds: collections.abc.Sequence, seed: typing.SupportsInt | typing.SupportsIndex = 0) -> None:
        """
        Replaces all worlds by other worlds on other maps, at the start of their first episodes. Afterwards get the simulator's
        arrays again: arrays from before this call remain valid memory, but later calls may overwrite them. Raises the same
        errors as the constructor.
        """
    def snapshot(self) -> Snapshot:
        """
        Returns a copy of the state. The copy is in the simulator's memory.
        """
    def spawn_report(self) -> dict:
        """
        Returns a dict of the numbers of requested, spawned, refused, entered and left agents and of parked cars. Waits for the stream.
        """
    def state_hash(self) -> int:
        """
        Returns a 64-bit hash of the complete state, which is equal on all executors. Waits for the stream.
        """
    def step(self, actions: typing.Any) -> typing.Any:
        """
        Advances every world by one step. Returns the StepResult.
        
        actions: int32 [slots] in the simulator's memory, in [0, 12). An action is 3 times the index of the longitudinal jerk
        (-15, -4, 0, 4 m/s3) plus the index of the lateral jerk (-4, 0, 4 m/s3, left is positive). Actions of inactive agents
        are ignored.
        If the previous step ended a world's episode, this step starts the world's next episode instead, and its slots are not
        valid.
        Raises pictura.Error for an array of another shape, type or device, and for actions out of range; the state is then
        unchanged.
        """
    def step_commands(self, commands: typing.Any) -> typing.Any:
        """
        Advances every world by one step with commands, COMMAND_DTYPE [slots]. The kinds of commands are 0: an action; 1: a
        kinematic state; 2: absence for the rest of the episode; 3: the recorded state, in worlds of a pictura.Scenario. Returns
        and raises the same as step().
        """
    def time_steps(self, actions: typing.Any, steps: typing.SupportsInt | typing.SupportsIndex) -> float:
        """
        Executes steps with the same actions from C++. Returns the duration in seconds, for measurements of Python's overhead in
        step().
        """
    def totals(self) -> dict:
        """
        Returns a dict of counts and sums since construction. `reward_terms` is a dict. Waits for the stream.
        """
    @property
    def agent_of_slot(self) -> Array:
        """
        int32 [slots]: index of the slot's agent in its world.
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
        int32 [worlds]: index of the current episode.
        """
    @property
    def episode_over(self) -> Array:
        """
        bool [worlds]: whether the episode has ended; the next step then begins the next episode.
        """
    @property
    def episode_step(self) -> Array:
        """
        int32 [worlds]: number of completed steps in the current episode.
        """
    @property
    def episode_steps(self) -> int:
        ...
    @property
    def geometries(self) -> dict:
        """
        Geometries of the maps, by their handles in the scene.
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
        Observations of the current state, a dict of arrays [slots, ...]: ego, partners, lanes, boundaries, controls, walls, set_counts, conditioning, waypoints.
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
        Fields of the agents, a dict of read-only arrays [slots] or [slots, numbers per agent].
        """
    @property
    def stream(self) -> int:
        """
        The cudaStream_t on which work is enqueued, as int; 0: the legacy default stream.
        """
    @stream.setter
    def stream(self, arg1: typing.Any) -> None:
        ...
    @property
    def views(self) -> Array:
        """
        View of each slot for render(): uint8 [slots, 60] with the fields of VIEW_DTYPE.
        """
    @property
    def world_of_slot(self) -> Array:
        """
        int32 [slots]: index of the slot's world.
        """
    @property
    def worlds(self) -> list[tuple[int, int, int]]:
        """
        (index of the map, number of agents, global world) of each world.
        """
class Recorder:
    """
    Records one world as a replay. The simulator must be on the CPU. While the recorder exists, it records every step of the
    simulator, by any function.
    
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
        follow: agent that the page shows first, and whose decisions are recorded; -1: none.
        rig: cameras whose images of this agent are recorded at every step, losslessly, with the CPU renderer. By default no
        images are recorded, and the page draws images of the paper's cameras.
        Raises pictura.UsageError if the world or agent does not exist or the simulator is on CUDA.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def decide(self, logits: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], value: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        Records a policy's logits [12] and value for the followed agent, which belong to the next step.
        """
    def write(self, path: str, policy: str = '') -> None:
        """
        Ends the recording and writes it to a file, completely or not at all: *.html, a page for any browser, or *.mcap, for
        Foxglove. May be called repeatedly. policy: name of the policy, which the page shows. Raises pictura.Error if the file
        cannot be written.
        """
    @property
    def metrics(self) -> dict:
        """
        Dict of counts and sums so far.
        """
    @property
    def num_steps(self) -> int:
        """
        Number of recorded steps and resets.
        """
class LiveView:
    """
    Live page in the browser, which shows the only world of a simulator while it runs. The simulator must be on the CPU. The
    page can pause the simulator, take single steps, change the speed, and drive an agent with the keyboard. Steps of the
    simulator wait, so that they run in real time or at the speed that the page sets.
    
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
        port: port on the loopback interface; 0: a free port.
        host_name: if given, the server listens on all interfaces, and browsers reach this machine by this name.
        follow: agent that pages show first.
        rig: cameras of this agent's images; by default pages draw images of the paper's cameras.
        wait_for_page: whether the first step waits for the first page.
        Raises pictura.UsageError if this package has no server, and pictura.Error if the port is in use.
        """
    def __reduce_ex__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        ...
    def close(self) -> None:
        """
        Notifies pages that the simulation has ended. The simulator's steps no longer wait.
        """
    def decide(self, agent: typing.SupportsInt | typing.SupportsIndex, logits: typing.Annotated[numpy.typing.ArrayLike, numpy.float32], value: typing.SupportsFloat | typing.SupportsIndex = 0.0) -> None:
        """
        Sets a policy's logits [12] and value for an agent. Pages that follow this agent show them until the next call.
        """
    @property
    def address(self) -> str:
        """
        URL of the page, including a secret token.
        """
    @property
    def num_pages(self) -> int:
        """
        Number of connected pages.
        """
def _expand_map_names(names: collections.abc.Sequence[str]) -> list[str]:
    """
    Returns the names of maps, in which each range of generated towns, such as 'procedural:1000-1011', is expanded.
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
    Draws random worlds until they fill the slots. The number of agents of a world is uniform in [min_agents, max_agents].
    Worlds use the maps in turn. Returns (index of the map, number of agents, global world) of each world.
    
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
    Returns views (poses of a rig) as a NumPy array of VIEW_DTYPE [n].
    
    Args:
        origin_m: [n, 3], origins of the rig on the ground, in metres.
        heading_rad: [n], headings in radians.
        world: [n], indices of worlds; default: 0.
        ego_agent: [n], index of the box in the scene that is not drawn in the view; -1: none.
        body_length_m: [n], lengths of the bodies that carry the rig. Bodies shorter than 4.5 m move the cameras closer to
            the origin.
    
    Raises:
        pictura.Error: An array has another shape.
    
    Examples:
        >>> pictura.make_views(origin_m=[[0, 0, 0], [5, 0, 0]], heading_rad=[0, 1.5]).shape
        (2,)
    """
def map_folder() -> str:
    """
    Returns the folder in which load() looks for towns: $PICTURA_DATA, or the user's data folder.
    
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
    Writes FOLDER/index.html, an index of the replays in the folder, sorted from the worst. Returns the number of replays.
    Raises pictura.Error, which names a page that is not a replay.
    
    Examples:
        >>> pictura.write_gallery('replays')            # doctest: +SKIP
        4
    """
AGENT_FIELDS: tuple = (('x_m', 'f32', 1, False, 'rear axle, or the centre of a pedestrian'), ('y_m', 'f32', 1, False, ''), ('z_m', 'f32', 1, False, 'height of the road under it'), ('heading_rad', 'f32', 1, False, 'counter-clockwise from x, in [-pi, pi]'), ('cos_heading', 'f32', 1, True, ''), ('sin_heading', 'f32', 1, True, ''), ('speed_mps', 'f32', 1, False, 'signed, along the heading'), ('accel_long_mps2', 'f32', 1, False, ''), ('accel_lat_mps2', 'f32', 1, False, 'positive to the left'), ('steer_rad', 'f32', 1, False, 'front wheel angle, positive to the left'), ('jerk_long_mps3', 'f32', 1, False, 'realised in the last step'), ('jerk_lat_mps3', 'f32', 1, False, ''), ('length_m', 'f32', 1, False, 'length of the box'), ('width_m', 'f32', 1, False, ''), ('height_m', 'f32', 1, False, ''), ('lane', 'i32', 1, True, 'current lane, -1 none'), ('lane_offset_m', 'f32', 1, True, 'signed, positive to the left of the centre line'), ('lane_angle_rad', 'f32', 1, True, "heading less the lane's direction, in [-pi, pi]"), ('speed_limit_mps', 'f32', 1, True, 'limit of the current lane'), ('waypoint_x_m', 'f32', 3, False, 'the goal chain; passed waypoints stay until it is renewed'), ('waypoint_y_m', 'f32', 3, False, ''), ('waypoint_z_m', 'f32', 3, False, ''), ('next_waypoint', 'i32', 1, False, 'index of the active one, in [0, 3)'), ('goal_lane', 'i32', 1, False, 'lane (or piece of a walkway) of the last waypoint, where the next chain starts'), ('goal_lane_s_m', 'f32', 1, False, 'arc length of the last waypoint on it'), ('goal_chains', 'i32', 1, False, 'chains drawn in this episode'), ('goal_x_m', 'f32', 1, False, 'last waypoint of a chain, for the metric Goals; see rules/step.h'), ('goal_y_m', 'f32', 1, False, ''), ('goal_z_m', 'f32', 1, False, ''), ('goal_open', 'u8', 1, False, '1: the goal is set and not yet passed'), ('conditioning', 'f32', 17, False, 'reward coefficients and dynamics multipliers; see simulator/conditioning.h'), ('agent_class', 'u8', 1, False, 'AgentClass'), ('status', 'u8', 1, False, 'AgentStatus'), ('refusal', 'u8', 1, True, 'SpawnFailure, of an absent agent'), ('halt_reason', 'u8', 1, False, 'Event bits that halted it'), ('events', 'u8', 1, False, 'Event bits of the last step'), ('goals_reached', 'i32', 1, False, 'last waypoints passed within 2 m in this episode'), ('waypoints_reached', 'i32', 1, False, "waypoints (also goals) passed within the reward's radius"), ('distance_m', 'f32', 1, False, 'sum of |speed| dt in this episode'), ('first_motion_step', 'i32', 1, False, 'first step (from 1) with a speed above kRest_mps; 0: none yet'), ('episode_events', 'u8', 1, False, "union of the episode's event bits"), ('episode_return', 'f32', 1, False, 'sum of rewards in this episode'), ('life', 'i32', 1, True, 'number of earlier lives in this episode'), ('life_step', 'i32', 1, True, 'step of this episode at which the life began'), ('left', 'u8', 1, True, '1: it left in the last step'))
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
