"""Policies as torch modules. docs/explanation/network.md defines the network.

load_policy() reads a checkpoint, or weights that training wrote (policy.safetensors). save_policy() writes weights, so
that the `pictura` command can run a policy trained in Python. export_onnx() writes an ONNX model.
"""

from __future__ import annotations

import contextlib
import copy
import importlib.util
import itertools
import json
import math
import os
import pathlib
import struct
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

try:
    import torch
except ModuleNotFoundError as error:
    raise ModuleNotFoundError("pictura.torch needs torch: pip install 'pictura[train]'", name=error.name) from error
from torch import Tensor, nn
from torch.nn import functional

import pictura
from pictura._pictura import _hash64, _removed_keys

_SCALE_POSITION_M = 120.0  # scale of x and y in observations
_NUM_ACTIONS = 12
# Entity sets, in the order of the columns of set_counts: number of features of a row, and number of points (x, y) with
# which the row begins.
_SETS = {"partners": (8, 1), "lanes": (7, 1), "boundaries": (7, 1), "controls": (7, 2), "walls": (7, 1)}
_SEGMENTS = {"lanes", "boundaries", "walls"}  # sets of segments
_ONNX_OPSET = 20  # the first opset that has Gelu
_MAGIC = b"PICTCKPT"
_PREAMBLE = "<8sIIQ"


def _near_and_far(pairs_m: Tensor) -> Tensor:
    size_m = pairs_m.abs()
    return torch.cat([pairs_m / (size_m + 4.0), pairs_m / (size_m + 20.0)], -1)


def point_features(rows: Tensor, points: int) -> Tensor:
    """Returns features [..., 6 * points] of the points (x, y) with which rows [..., n] begin.

    The features have a higher resolution near the agent than x and y.
    """
    xy_m = (rows[..., : 2 * points] * _SCALE_POSITION_M).unflatten(-1, (points, 2))
    return torch.cat([_near_and_far(xy_m), xy_m / (xy_m.norm(dim=-1, keepdim=True) + 1.0)], -1).flatten(-2)


def segment_features(rows: Tensor) -> Tensor:
    """Returns features [..., 4] of the agent's position relative to segments, rows [..., 7]: the offsets along the
    segment and to its left."""
    x_m, y_m = (rows[..., :2] * -_SCALE_POSITION_M).unbind(-1)  # agent relative to the middle
    cos, sin = rows[..., 4:6].unbind(-1)
    return _near_and_far(torch.stack([x_m * cos + y_m * sin, cos * y_m - sin * x_m], -1))


def _normalize(x: Tensor) -> Tensor:
    return functional.layer_norm(x, x.shape[-1:])


def _refuse_removed(config: Mapping[str, Any]) -> None:
    """Raises pictura.UsageError if the `policy` table has a removed key with an invalid value. Each removed key has one
    valid value."""
    for key, value, reason in _removed_keys():
        name = key.removeprefix("policy.")
        if name in config and json.dumps(config[name]) != value:
            raise pictura.UsageError(f"{key}: expected {value}, got {json.dumps(config[name])}: {reason}")


def _as_tensors(array: Any, device: torch.device) -> Any:
    """Converts a tensor, a NumPy array, or a list of these to tensors."""
    return [_as_tensors(each, device) for each in array] if isinstance(array, list) else torch.as_tensor(array, device=device)


class _Encoder(nn.Module):
    def __init__(self, features: int, width: int, layer_norm: bool) -> None:
        super().__init__()
        self.hidden, self.out, self.layer_norm = nn.Linear(features, width), nn.Linear(width, width), layer_norm

    def forward(self, x: Tensor) -> Tensor:
        x = self.hidden(x)
        return self.out(functional.gelu(_normalize(x) if self.layer_norm else x))


class _Attention(nn.Module):
    """Attention of learned queries of each camera to the tokens of the camera's feature map.

    All images use the same queries. Therefore scores are computed directly from tokens, q (W t) = (q W) t, and values
    from weighted sums of tokens (docs/explanation/network.md). Keys and values of single tokens are not computed.
    """

    def __init__(self, cameras: int, queries: int, width: int, heads: int, mlp: int, concatenate: bool) -> None:
        super().__init__()
        self.heads, self.concatenate = heads, concatenate
        self.position = nn.Linear(8, width)
        self.token_norm, self.query_norm = nn.LayerNorm(width), nn.LayerNorm(width)
        self.queries = nn.Parameter(torch.randn(cameras, queries, width))
        self.query, self.value, self.out = (nn.Linear(width, width) for _ in range(3))
        self.key = nn.Linear(width, width, bias=False)
        if mlp > 0:
            self.mlp_norm, self.mlp_hidden, self.mlp_out = nn.LayerNorm(width), nn.Linear(width, mlp), nn.Linear(mlp, width)

    def forward(self, maps: Tensor, first: int) -> Tensor:
        """Returns embeddings [cameras, batch, width] (queries times width, if they are concatenated) of feature maps
        [cameras, batch, width, rows, columns]. `first` is the index of the first of these cameras in the rig."""
        cameras, rows, columns = maps.shape[0], *maps.shape[-2:]
        y = (torch.arange(rows, device=maps.device) + 0.5) * (math.pi / rows)
        x = (torch.arange(columns, device=maps.device) + 0.5) * (math.pi / columns)
        y, x = (a.flatten().to(maps.dtype) for a in torch.meshgrid(y, x, indexing="ij"))
        where = torch.stack([x.cos(), y.cos(), x.sin(), y.sin(), (2 * x).cos(), (2 * y).cos(), (2 * x).sin(), (2 * y).sin()], 1)
        tokens = self.token_norm(maps.flatten(3).transpose(2, 3) + self.position(where))
        queries = self.queries[first : first + cameras]
        key, value = (layer.weight.unflatten(0, (self.heads, -1)) for layer in (self.key, self.value))
        out = self.out.weight.unflatten(1, (self.heads, -1)).transpose(0, 1)
        query = self.query(self.query_norm(queries)).unflatten(-1, (self.heads, 1, -1))
        asked = (query @ key / math.sqrt(key.shape[1])).flatten(1, 3)
        # Scores [cameras, batch, tokens, queries x heads].
        scores = (tokens.flatten(1, 2) @ asked.transpose(1, 2)).unflatten(1, tokens.shape[1:3])
        sums = (scores.softmax(2).transpose(2, 3) @ tokens).unflatten(2, (-1, self.heads)).flatten(3)
        z = queries.unsqueeze(1) + functional.linear(sums, (out @ value).transpose(0, 1).flatten(1), self.out(self.value.bias))
        features = self._average(z)
        if hasattr(self, "mlp_norm"):
            features = features + self.mlp_out(self._average(functional.gelu(self.mlp_hidden(self.mlp_norm(z)))))
        return (features / features.shape[2]).flatten(2)  # concatenated features are the parts of a mean

    def _average(self, x: Tensor) -> Tensor:
        return x if self.concatenate else x.mean(2, keepdim=True)


class Policy(nn.Module):
    """A perspective policy, which reads images, or a vector policy, which reads entity sets.

    forward(observation) returns logits float32 [batch, 12] and values float32 [batch]. The observation is a dict of
    tensors [batch, ...] or NumPy arrays, with names and types as in pictura.Simulator.observations. Both policies read
    `ego`, `conditioning` and `waypoints`. A vector policy also reads `set_counts` and the entity sets. A perspective
    policy also reads `rgb`: uint8 [batch, cameras, 3, height, width]. If cameras have several sizes, `rgb` is a list of
    tensors in the order of the rig, each for consecutive cameras of one size.

    Args:
        config: The `policy` table of a configuration (docs/reference/configuration.md).
        num_cameras: Number of cameras of a perspective policy.
        walls: Whether a vector policy reads the entity set `walls`.

    Attributes:
        metadata: Metadata of the file that load_policy() read: `path`, `config` (the whole configuration of the
            training), `schema`, `rig`, `update`, `agent_steps` and more. Empty for a policy that is not from a file.

    Raises:
        pictura.UsageError: The observation lacks an array that the policy reads, or its images have another size.

    Examples:
        >>> from pictura.torch import Policy
        >>> policy = Policy({"modality": "vector", "embedding_width": 32, "backbone_layers": 2, "backbone_width": 64})
        >>> envs = pictura.make_vec("procedural:3", num_agents=4)
        >>> observations, infos = envs.reset(seed=1)
        >>> logits, values = policy(observations)
        >>> logits.shape, values.shape
        (torch.Size([4, 12]), torch.Size([4]))
    """

    def __init__(self, config: Mapping[str, Any], num_cameras: int = 4, walls: bool = False) -> None:
        super().__init__()
        if config.get("backbone", "conv") != "conv":
            raise pictura.UsageError(f"policy.backbone: expected 'conv', got '{config['backbone']}', which is a separate program")
        _refuse_removed(config)
        self.config = dict(config)
        self.metadata: dict[str, Any] = {}
        self.modality = config["modality"]
        self.points, self.segments = bool(config.get("point_features", False)), bool(config.get("segment_features", False))
        self.layer_norm, self.residual = bool(config.get("layer_norm", False)), bool(config.get("residual", False))
        width = config["embedding_width"]
        self.num_cameras = num_cameras
        if self.modality == "perspective":
            self.patch_px, self.strides = config["patch_px"], list(config["conv_strides"])
            self.conv_norm = bool(config.get("conv_norm", False))
            channels = [3 * self.patch_px**2, *config["conv_channels"]]
            self.conv = nn.ModuleList(
                nn.Conv2d(i, o, kernel, stride, kernel // 2)
                for i, o, kernel, stride in zip(channels, channels[1:], config["conv_kernels"], self.strides)
            )
            self.attention = _Attention(
                num_cameras, config["num_queries"], channels[-1], config["attention_heads"], config["attention_mlp"],
                bool(config.get("concatenate_queries", False)),
            )  # fmt: skip
            pooled = config["num_queries"] if self.attention.concatenate else 1
            self.project = nn.Linear(num_cameras * pooled * channels[-1], 4 * width)
            around, ego = 4 * width, 7
        elif self.modality == "vector":
            self.sets = [name for name in _SETS if name != "walls" or walls]
            for name in self.sets:
                features, points = _SETS[name]
                features += 6 * points * self.points + 4 * (self.segments and name in _SEGMENTS)
                self.add_module(name, _Encoder(features, width, self.layer_norm))
            around, ego = len(self.sets) * width, 9
        else:
            raise pictura.UsageError(f"policy.modality: expected 'perspective' or 'vector', got '{self.modality}'")
        self.ego_features = ego
        self.ego = _Encoder(ego, width, self.layer_norm)
        self.conditioning = _Encoder(17 + 3 * (3 + 6 * self.points), width, self.layer_norm)
        layers, inside = config["backbone_layers"], config["backbone_width"]
        self.backbone = nn.ModuleList(nn.Linear(around + 2 * width if i == 0 else inside, inside) for i in range(layers))
        self.actor, self.critic = nn.Linear(inside, _NUM_ACTIONS), nn.Linear(inside, 1)

    def forward(self, observation: Mapping[str, Any]) -> tuple[Tensor, Tensor]:
        """Returns logits float32 [batch, 12] and values float32 [batch] of an observation."""
        observation = self._read(observation)
        waypoints = observation["waypoints"].flatten(1)
        own = [observation["conditioning"].flatten(1), waypoints]
        if self.points:
            own.append(point_features(waypoints.unflatten(1, (3, 3)), 1).flatten(1))
        around = self._images(observation["rgb"]) if self.modality == "perspective" else self._entities(observation)
        ego = observation["ego"].flatten(1)[:, : self.ego_features]
        x = self._trunk(torch.cat([around, self.ego(ego), self.conditioning(torch.cat(own, 1))], 1))
        return self.actor(x), self.critic(x).squeeze(1)

    def act(self, observation: Mapping[str, Any], argmax: bool = True) -> Tensor:
        """Returns actions int32 [batch] for pictura.Simulator.step, without gradients."""
        with torch.no_grad():
            logits = self(observation)[0]
            chosen = logits.argmax(1) if argmax else torch.distributions.Categorical(logits=logits).sample()
        return chosen.to(torch.int32)

    @property
    def observation_names(self) -> list[str]:
        """Names of the observation arrays that this policy reads."""
        read = ["rgb"] if self.modality == "perspective" else ["set_counts", *self.sets]
        return ["ego", "conditioning", "waypoints", *read]

    def _read(self, observation: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the arrays that this policy reads, as tensors on its device."""
        names = self.observation_names
        if not isinstance(observation, Mapping):
            raise pictura.UsageError(f"observation: expected a dict with {', '.join(names)}, got {type(observation).__name__}")
        missing = [name for name in names if name not in observation]
        if missing:
            raise pictura.UsageError(
                f"observation: a {self.modality} policy reads {', '.join(names)}: expected '{missing[0]}', got {', '.join(observation)};"
                " pictura.make_vec_for(policy) makes environments with these observations"
            )
        return {name: _as_tensors(observation[name], self.actor.weight.device) for name in names}

    def _trunk(self, x: Tensor) -> Tensor:
        for i, layer in enumerate(self.backbone):
            y = functional.gelu(layer(_normalize(x) if self.layer_norm and i > 0 else x))
            x = x + y if self.residual and i > 0 else y
        return _normalize(x) if self.layer_norm else x

    def _entities(self, observation: Mapping[str, Tensor]) -> Tensor:
        counts = observation["set_counts"].flatten(1)
        embeddings = []
        for name in self.sets:
            rows = observation[name]
            parts = [rows]
            if self.points:
                parts.append(point_features(rows, _SETS[name][1]))
            if self.segments and name in _SEGMENTS:
                parts.append(segment_features(rows))
            members = torch.cat(parts, 2)
            column = list(_SETS).index(name)
            there = torch.arange(members.shape[1], device=members.device) < counts[:, column : column + 1]
            embedded = getattr(self, name)(members).masked_fill(~there.unsqueeze(2), -math.inf)
            largest = embedded.amax(1)
            embeddings.append(largest.masked_fill(~there.any(1, keepdim=True), 0.0))
        return torch.cat(embeddings, 1)

    def _images(self, images: Tensor | list[Tensor]) -> Tensor:
        blocks = [images] if isinstance(images, Tensor) else images
        num_cameras = sum(block.shape[1] for block in blocks)
        if num_cameras != self.num_cameras:
            raise pictura.Error(f"rgb: expected images of {self.num_cameras} cameras, got {num_cameras}")
        learnt = [tuple(camera["size_px"]) for camera in self.metadata.get("rig", [])]
        shown = [(block.shape[4], block.shape[3]) for block in blocks for _ in range(block.shape[1])]
        for number, (expected, got) in enumerate(zip(learnt, shown)):
            if got != expected:
                raise pictura.UsageError(
                    f"rgb: camera {number}: expected images of {expected[0]}x{expected[1]}, as in training, got"
                    f" {got[0]}x{got[1]}; pictura.make_vec_for(policy) shows those, `pictura export --size` grows a policy"
                )
        embedded, first = [], 0
        for block in blocks:
            embedded.extend(self.attention(self._maps(block), first))
            first += block.shape[1]
        return self.project(torch.cat(embedded, 1))

    def _maps(self, pixels: Tensor) -> Tensor:
        """Returns feature maps [cameras, batch, width, rows, columns] of images uint8 [batch, cameras, 3, height,
        width].

        All cameras share the convolutions, so their images form one batch.
        """
        patch, x = self.patch_px, pixels.transpose(0, 1)
        right, below = -x.shape[4] % patch, -x.shape[3] % patch
        if right or below:
            x = functional.pad(x, (0, right, 0, below))
        x = x.flatten(0, 1)
        # Patches are extracted from bytes, before the conversion to floats. On CUDA channels are the last axis, which
        # tensor cores need; on the CPU this layout is slower.
        layout = torch.channels_last if x.is_cuda else torch.contiguous_format
        x = functional.pixel_unshuffle(x, patch).to(self.actor.weight.dtype, memory_format=layout)
        for i, layer in enumerate(self.conv):
            # The weights of the first layer are divided by 255 instead of the pixels.
            weight = layer.weight / 255.0 if i == 0 else layer.weight
            x = functional.conv2d(x, weight, layer.bias, layer.stride, layer.padding)
            if self.conv_norm:
                x = _normalize(x.permute(0, 2, 3, 1)).permute(0, 3, 1, 2)
            x = functional.gelu(x)
        return x.unflatten(0, (pixels.shape[1], -1))


_TYPES = {"F32": torch.float32, "BF16": torch.bfloat16, "I64": torch.int64}  # element types in safetensors files
_NO_HASH = b"0" * 16


def _seal(data: bytearray, header_end: int, saved: str) -> None:
    """Updates the hash in a changed safetensors file: the hash of the whole file, with zeros as digits of the hash."""
    place = data.find(f'"hash":"{saved}"'.encode(), 8, header_end) + len('"hash":"')
    data[place : place + len(_NO_HASH)] = _NO_HASH
    data[place : place + len(_NO_HASH)] = f"{_hash64(bytes(data)):016x}".encode()


def _read_safetensors(path: str) -> tuple[dict[str, Any], dict[str, Tensor]]:
    data = pathlib.Path(path).read_bytes()
    if len(data) < 8:
        raise pictura.Error(f"{path}: no safetensors: {len(data)} bytes")
    (length,) = struct.unpack_from("<Q", data)
    if length > len(data) - 8:
        raise pictura.Error(f"{path}: not safetensors, or truncated: its header has {length} bytes, the file {len(data)}")
    try:
        header = json.loads(data[8 : 8 + length])
    except ValueError as error:
        raise pictura.Error(f"{path}: its header cannot be read: {error}") from error
    metadata = header.pop("__metadata__", {})
    tensors = {}
    for name, entry in header.items():
        begin, end = entry["data_offsets"]
        if entry["dtype"] not in _TYPES or end > len(data) - 8 - length or end < begin:
            raise pictura.Error(f"{path}: {name}: expected F32, BF16 or I64 within the file, got {entry['dtype']} at {begin} to {end}")
        raw = bytearray(data[8 + length + begin : 8 + length + end])
        tensors[name] = torch.frombuffer(raw, dtype=_TYPES[entry["dtype"]]).reshape(entry["shape"]).clone()
    return metadata, tensors


def _read_checkpoint(path: str) -> tuple[dict[str, Any], bytearray, int]:
    """Returns the header, the whole file, and the offset of its data."""
    data = bytearray(pathlib.Path(path).read_bytes())
    size = struct.calcsize(_PREAMBLE)
    if len(data) < size + 8 or data[:8] != _MAGIC:
        raise pictura.Error(f"{path}: not a checkpoint: expected it to begin with PICTCKPT")
    _, version, order, length = struct.unpack_from(_PREAMBLE, data)
    if version != 2 or order != 0x01020304:
        raise pictura.Error(f"{path}: expected a checkpoint of version 2 and this byte order, got {version}, {order:#x}")
    (stored,) = struct.unpack_from("<Q", data, len(data) - 8)
    if _hash64(bytes(data[:-8])) != stored:
        raise pictura.Error(f"{path}: damaged or truncated: its bytes do not match the hash at its end")
    return json.loads(data[size : size + length]), data, size + length


def _policy_of(config_toml: str, tensors: dict[str, Tensor], metadata: Mapping[str, Any], path: str) -> Policy:
    try:
        whole_config = tomllib.loads(config_toml)
        config = whole_config["policy"]
    except (tomllib.TOMLDecodeError, KeyError) as error:
        raise pictura.Error(f"{path}: expected the training configuration, with a table 'policy': {error}") from error
    queries = tensors.get("attention.queries")
    # The device "meta" allocates no memory. Otherwise wrong sizes in a broken file could exhaust the memory.
    with torch.device("meta"):
        policy = Policy(config, 0 if queries is None else len(queries), "walls.hidden.weight" in tensors)
    weights = {name: tensor.to(torch.float32) if tensor.is_floating_point() else tensor for name, tensor in tensors.items()}
    missing, unexpected = policy.load_state_dict(weights, strict=False, assign=True)
    if missing or unexpected:
        raise pictura.Error(f"{path}: has a different architecture: expected {sorted(missing)}, got {sorted(unexpected)}")
    policy.metadata = {**metadata, "path": path, "config": whole_config}
    return policy


@contextlib.contextmanager
def _named(path: str) -> Iterator[None]:
    """Converts any exception that a broken file causes to a pictura.Error, which names the file."""
    try:
        yield
    except (pictura.Error, OSError):
        raise
    except Exception as error:
        raise pictura.Error(f"{path}: damaged, or not a policy of this library: {type(error).__name__}: {error}") from error


def load_policy(path: str | os.PathLike[str], average: bool = False) -> Policy:
    """Reads a policy from policy.safetensors or a checkpoint (.ckpt), in fp32 on the CPU.

    Args:
        path: The file.
        average: Whether to read the average of weights, which checkpoints contain if train.weight_average was set.

    Raises pictura.Error, which describes the fault of the file, and pictura.UsageError if the policy's backbone is a
    separate program.

    Examples:
        >>> from pictura.torch import load_policy
        >>> policy = load_policy("models/vector.safetensors")
        >>> policy.modality, policy.metadata["config"]["policy"]["backbone_width"]
        ('vector', 1024)
    """
    path = os.fspath(path)
    with _named(path):
        return _load(path, average)


def _load(path: str, average: bool) -> Policy:
    if pathlib.Path(path).suffix != ".ckpt":
        if average:
            raise pictura.Error(f"{path}: holds one set of weights: expected a checkpoint for the weight average")
        metadata, tensors = _read_safetensors(path)
        texts = {name: json.loads(metadata[name]) for name in ("schema", "rig", "rate_factors") if metadata.get(name)}
        numbers = {name: int(metadata[name]) for name in ("update", "agent_steps") if name in metadata}
        return _policy_of(metadata.get("config", ""), tensors, metadata | texts | numbers, path)
    header, data, begin = _read_checkpoint(path)
    tensors = {}
    if average and "average" not in header:
        raise pictura.Error(f"{path}: holds no weight average: expected a checkpoint of a run with train.weight_average")
    for entry in header["average" if average else "parameters"]:
        count = math.prod(entry["shape"])
        values = torch.frombuffer(data, dtype=torch.float32, count=count, offset=begin + entry["offset"])
        tensors[entry["name"]] = values.reshape(entry["shape"]).clone()
    counters = {name: header.get("counters", {}).get(name) for name in ("update", "agent_steps")}
    kept = {name: value for name, value in header.items() if name not in ("parameters", "average", "moments", "recent", "counters")}
    return _policy_of(header["config"], tensors, kept | counters, path)


def save_policy(policy: Policy, path: str | os.PathLike[str], like: str | os.PathLike[str]) -> None:
    """Writes a copy of a checkpoint (.ckpt) or safetensors file with the weights of a policy of the same architecture.

    Everything else is copied from the file `like`, and the types of its numbers are kept. So the `pictura` command can
    read the new file. The file is written completely or not at all.

    Args:
        policy: Policy with the weights to write.
        path: The new file.
        like: The file to copy.

    Raises:
        pictura.Error: The architectures differ, or `like` is damaged.

    Examples:
        >>> from pictura.torch import load_policy, save_policy
        >>> policy = load_policy("models/vector.safetensors")
        >>> save_policy(policy, "mine.safetensors", like="models/vector.safetensors")
    """
    path, like = os.fspath(path), os.fspath(like)
    weights = {name: value.detach().to("cpu", torch.float32).contiguous() for name, value in policy.state_dict().items()}
    with _named(like):
        if pathlib.Path(like).suffix == ".ckpt":
            header, data, begin = _read_checkpoint(like)
            entries = {entry["name"]: (entry["shape"], begin + entry["offset"]) for entry in header["parameters"]}
        else:
            data = bytearray(pathlib.Path(like).read_bytes())
            (length,) = struct.unpack_from("<Q", data)
            header = json.loads(data[8 : 8 + length])
            metadata = header.pop("__metadata__", {})
            entries = {name: (entry["shape"], 8 + length + entry["data_offsets"][0]) for name, entry in header.items()}
            types = {name: _TYPES[entry["dtype"]] for name, entry in header.items()}
            weights = {name: value.to(types.get(name, value.dtype)) for name, value in weights.items()}
    if {name: shape for name, (shape, _) in entries.items()} != {name: list(value.shape) for name, value in weights.items()}:
        raise pictura.Error(f"{like}: its architecture differs from the policy: expected the same names and shapes of weights")
    for name, value in weights.items():
        raw = value.view(torch.uint8).numpy().tobytes()
        data[entries[name][1] : entries[name][1] + len(raw)] = raw
    if pathlib.Path(like).suffix == ".ckpt":
        data[-8:] = struct.pack("<Q", _hash64(bytes(data[:-8])))
    elif "hash" in metadata:
        _seal(data, 8 + length, metadata["hash"])
    _write_whole(path, data)


def _write_whole(path: str, data: bytes | bytearray) -> None:
    beside = pathlib.Path(f"{path}.part{os.getpid()}")
    try:
        beside.write_bytes(data)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


class _PolicyOfArrays(nn.Module):
    """Policy whose arguments are the arrays of an observation, instead of a dict."""

    def __init__(self, policy: Policy, images: list[str]) -> None:
        super().__init__()
        self.policy, self.images = policy, images

    def forward(self, *arrays: Tensor) -> tuple[Tensor, Tensor]:
        names = self.policy.observation_names
        observation: dict[str, Any] = dict(zip(names, arrays))
        if self.images:
            observation["rgb"] = list(arrays[names.index("rgb") :])
        return self.policy(observation)


def _example_observation(policy: Policy) -> dict[str, Tensor]:
    """Returns zeros of batch size 2 for each array that a policy reads. Images of several sizes are rgb_0, rgb_1,
    ..."""
    types = {"f32": torch.float32, "i32": torch.int32}
    known = {name: (types[kind], (rows, numbers) if rows > 1 else (numbers,)) for name, kind, rows, numbers in pictura.OBSERVATION_ARRAYS}
    example = {name: torch.zeros(2, *known[name][1], dtype=known[name][0]) for name in policy.observation_names if name != "rgb"}
    if policy.modality == "perspective":
        if "rig" not in policy.metadata:
            raise pictura.UsageError("policy: expected a policy loaded by load_policy(), whose file gives the image size")
        blocks = [(size, len(list(group))) for size, group in itertools.groupby(tuple(each["size_px"]) for each in policy.metadata["rig"])]
        for number, ((width, height), cameras) in enumerate(blocks):
            name = "rgb" if len(blocks) == 1 else f"rgb_{number}"
            example[name] = torch.zeros(2, cameras, 3, height, width, dtype=torch.uint8)
    return example


def export_onnx(policy: Policy, path: str | os.PathLike[str]) -> None:
    """Writes a policy as an ONNX model of opset 20. Needs the packages onnx and onnxscript.

    The model's inputs are the arrays that Policy reads, [batch, ...] of any batch size, with their names. Images of
    cameras of several sizes are rgb_0, rgb_1, ... Outputs are `logits` float32 [batch, 12] and `value` float32 [batch].
    The model's property `pictura` contains the policy's metadata without the path, as JSON. The file is written
    completely or not at all.

    Args:
        policy: The policy.
        path: The new file.

    Raises:
        pictura.Error: A package is missing.
        pictura.UsageError: The policy reads images, and was not loaded from a file, so their size is unknown.

    Examples:
        >>> from pictura.torch import export_onnx, load_policy
        >>> export_onnx(load_policy("models/vector.safetensors"), "vector.onnx")      # doctest: +SKIP
    """
    for package in ("onnx", "onnxscript"):
        if importlib.util.find_spec(package) is None:
            raise pictura.Error(f"export_onnx: expected the package {package}, got none: pip install 'pictura[onnx]'")
    example = _example_observation(policy)
    images = [name for name in example if name.startswith("rgb")]
    module = _PolicyOfArrays(copy.deepcopy(policy).cpu(), images).eval()
    batch = torch.export.Dim("batch")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exporter warns about its own code
        program = torch.onnx.export(
            module,
            tuple(example.values()),
            dynamo=True,
            opset_version=_ONNX_OPSET,
            input_names=list(example),
            output_names=["logits", "value"],
            dynamic_shapes=(tuple({0: batch} for _ in example),),
            verbose=False,
        )
    facts = {name: value for name, value in policy.metadata.items() if name != "path"}
    model = program.model_proto
    model.metadata_props.add(key="pictura", value=json.dumps(facts))
    _write_whole(os.fspath(path), model.SerializeToString())
