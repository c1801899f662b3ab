// Reads the page's own elements: the header, and the numbers of docs/reference/replay.md.

class Damaged extends Error {}

const STATUS = ["active", "halted", "parked", "absent", "recorded"];
const CLASSES = ["vehicle", "cyclist", "pedestrian"];
const EVENT = { collision: 1, atFault: 2, offRoad: 4, redLight: 8, wall: 16, goal: 32, waypoint: 64, metricGoal: 128 };
const INFRACTIONS = EVENT.collision | EVENT.offRoad | EVENT.redLight | EVENT.wall;
const KINDS = [
  { bit: EVENT.collision, name: "collision", color: "--collision" },
  { bit: EVENT.offRoad, name: "off road", color: "--off-road" },
  { bit: EVENT.redLight, name: "red light", color: "--red-light" },
  { bit: EVENT.wall, name: "wall", color: "--wall-contact" },
  { bit: EVENT.metricGoal, name: "goal", color: "--goal" },
];
const reasonsOf = bits => KINDS.filter(kind => bits & kind.bit & INFRACTIONS);
const ABSENT = 3, HALTED = 1;

function eventsOf(bits, agent, frame) {
  const found = [];
  KINDS.forEach((kind, k) => { if (bits & kind.bit) found.push({ frame, agent, kind: k }); });
  return found;
}

function bytesOfBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

async function inflated(bytes, size) {
  if (typeof DecompressionStream === "undefined") {
    throw new Damaged("This browser is too old to read the replay: it lacks DecompressionStream. Browsers of 2023 or later have it.");
  }
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const out = new Uint8Array(await new Response(stream).arrayBuffer());
  if (out.length !== size) throw new Damaged(`expected ${size} bytes, got ${out.length}`);
  return out;
}

class NumberReader {
  constructor(bytes) { this.bytes = bytes; this.at = 0; }
  next() {
    let bits = 0, shift = 0, byte;
    do {
      if (this.at >= this.bytes.length || shift > 28) throw new Damaged("its numbers are truncated");
      byte = this.bytes[this.at++];
      bits |= (byte & 127) << shift;
      shift += 7;
    } while (byte > 127);
    return (bits >>> 1) ^ -(bits & 1);
  }
  get isAtEnd() { return this.at === this.bytes.length; }
  many(count) { return Array.from({ length: count }, () => this.next()); }
  // Reads `columns` columns in order. A column contains all frames.
  columns(columns, frames, order) {
    // Each number takes at least a byte, which is checked before memory is allocated for a corrupted count.
    if (columns * frames > this.bytes.length) throw new Damaged("its numbers are truncated");
    const values = new Int32Array(columns * frames);
    for (let column = 0, i = 0; column < columns; ++column) {
      let value = 0, difference = 0;
      for (let frame = 0; frame < frames; ++frame, ++i) {
        const next = this.next();
        difference = order === 2 ? (difference + next) | 0 : next;
        value = order === 0 ? next : (value + difference) | 0;
        values[i] = value;
      }
    }
    return values;
  }
}

const SHAPES = ["lane", "crosswalk", "parking_space", "marking", "stop_line", "road_edge", "wall", "light"];

// Returns [{kind, detail, width_m, points: Float32Array of x, y in metres}].
function mapOf(reader) {
  const shapes = [];
  let x = 0, y = 0;
  for (let left = reader.next(); left > 0; --left) {
    const kind = SHAPES[reader.next()], detail = reader.next(), width_m = reader.next() / 100, count = reader.next();
    const points = new Float32Array(2 * count);
    for (let i = 0; i < count; ++i) {
      points[2 * i] = (x += reader.next()) / 100;
      points[2 * i + 1] = (y += reader.next()) / 100;
    }
    shapes.push({ kind, detail, width_m, points });
  }
  return shapes;
}

// Returns the geometry that cameras see: painted lines, walls, and light heads, in metres and radians.
function sceneryOf(reader) {
  const at = [0, 0, 0], point = () => at.map((_, i) => (at[i] += reader.next()) / 100), list = make => Array.from({ length: reader.next() }, make);
  const lines = list(() => ({ kind: reader.next(), color: reader.many(3), width_m: reader.next() / 1000, points: list(point) }));
  const walls = list(() => ({ color: reader.many(3), height_m: reader.next() / 100, a: point(), b: point() }));
  const heads = list(() => {
    const [signal, facing, half] = reader.many(3);
    return { signal, facing_rad: facing / 1800 * Math.PI, half_angle_rad: half / 1800 * Math.PI, position: point() };
  });
  return { lines, walls, heads };
}

function episodesOf(reader, agents) {
  const body = () => {
    const [agentClass, length, width, height] = reader.many(4);
    return { agentClass, length_m: length / 100, width_m: width / 100, height_m: height / 100 };
  };
  return Array.from({ length: reader.next() }, () => {
    const [index, first, frames] = reader.many(3);
    const bodies = Array.from({ length: agents }, body);
    const parked = Array.from({ length: reader.next() }, () => {
      const car = body(), [x, y, z, heading] = reader.many(4);
      return { ...car, x_m: x / 100, y_m: y / 100, z_m: z / 100, heading_deg: heading / 10 };
    });
    const chains = Array.from({ length: agents }, () => []);
    for (let left = reader.next(); left > 0; --left) {
      const [frame, agent] = reader.many(2), metres = reader.many(9).map(cm => cm / 100);
      chains[agent].push({ frame, x_m: metres.slice(0, 3), y_m: metres.slice(3, 6) });
    }
    return { index, first, frames, end: first + frames, bodies, parked, chains };
  });
}

// Sections of every replay, including one for each of its tracks.
const SECTIONS = ["map", "scenery", "episodes", "conditioning", "lights"];

// Complete replay, with everything that views read.
class Replay {
  constructor(header, bytes, imageBytes) {
    this.header = header;
    const { agents, frames, lights } = header;
    Object.assign(this, { agents, frames, dt_s: header.dt_s, followed: header.followed, numLights: lights, firstStep: 0, version: 0, imageSource: "as recorded" });
    const orders = new Map(header.tracks.map(track => [track.name, track]));
    this.tracks = {};
    this.units = {};
    let at = 0, conditioning = null;
    for (const { name, bytes: size } of header.sections) {
      const part = bytes.subarray(at, at + size), reader = new NumberReader(part);
      at += size;
      if (name === "map") this.map = mapOf(reader);
      else if (name === "scenery") this.scenery = sceneryOf(reader);
      else if (name === "episodes") this.episodes = episodesOf(reader, agents);
      else if (name === "conditioning") conditioning = new Float32Array(part.slice().buffer);
      else if (name === "lights") this.lights = reader.columns(lights, frames, 1);
      else if (name === "decisions") this.decisions = reader.columns(13, frames, 1);
      else if (name === "followed") this.followedAgents = reader.columns(1, frames, 1);
      else {
        const track = orders.get(name);
        if (!track) throw new Damaged(`it has an unknown section ${name}`);
        this.tracks[name] = reader.columns(agents, frames, track.order);
        this.units[name] = track.unit;
      }
      // Remaining bytes were written for another header.
      if (name !== "conditioning" && !reader.isAtEnd) throw new Damaged(`its section ${name} has more numbers than its header declares`);
    }
    for (const name of [...SECTIONS, ...orders.keys()]) {
      if (!header.sections.some(section => section.name === name)) throw new Damaged(`it lacks the section ${name}`);
    }
    const perEpisode = agents * header.conditioning.length;
    if (conditioning.length !== this.episodes.length * perEpisode) throw new Damaged("its conditioning does not match its agents and episodes");
    this.episodes.forEach((episode, i) => { episode.conditioning = conditioning.subarray(i * perEpisode, (i + 1) * perEpisode); });
    this.stride = frames;
    this.episodeOf = new Uint16Array(frames);
    this.episodes.forEach((episode, i) => this.episodeOf.fill(i, episode.first, episode.end));
    this.rewardTerms = header.tracks.filter(track => track.name.startsWith("reward_")).map(track => track.name.slice(7));
    this.events = this.findEvents();
    this.probed = header.case;
    if (header.images) this.images = new Images(header, imageBytes);
  }
  // Columns have room for `stride` frames.
  raw(track, agent, frame) { return this.tracks[track][agent * this.stride + frame]; }
  get(track, agent, frame) { return this.raw(track, agent, frame) * this.units[track]; }
  episode(frame) { return this.episodes[this.episodeOf[frame]]; }
  isAbsent(agent, frame) { return this.raw("status", agent, frame) === ABSENT; }
  body(agent, frame) { return this.episode(frame).bodies[agent]; }
  light(light, frame) { return this.lights[light * this.stride + frame]; }
  // Returns the agent with decisions and images, or -1.
  followedAt(frame) { return this.followedAgents ? this.followedAgents[frame] : this.followed; }
  isFollowed(agent, frame) { return agent === this.followedAt(frame); }
  imagesOf(frame) { return this.images.frame(frame); }
  // Whether the file contains the images of an agent's cameras.
  hasImages(agent, frame) { return this.isFollowed(agent, frame) && Boolean(this.images) && frame < this.images.frames; }
  // Returns the road user of a probe's case, if an agent's case is shown: whether it is inserted, and the change of the
  // images that removes or adds it.
  caseUser(agent, frame) {
    const { probed } = this;
    if (!probed || probed.frame !== frame || probed.ego !== agent || (probed.removed === null && !probed.inserted)) return null;
    const box = probed.inserted;
    if (!box) return { isInserted: false, change: { hidden: [probed.removed] } };
    const body = { agentClass: box.class, length_m: box.length_cm / 100, width_m: box.width_cm / 100, height_m: box.height_cm / 100 };
    const pose = { x_m: box.x_cm / 100, y_m: box.y_cm / 100, z_m: box.z_cm / 100, heading_deg: box.heading_ddeg / 10 };
    return { isInserted: true, change: { added: [{ ...body, ...pose }] } };
  }
  // Returns a policy's response: 12 probabilities and the value; null without one.
  decision(agent, frame) {
    if (!this.isFollowed(agent, frame) || !this.decisions) return null;
    const values = [];
    let sum = 0;
    for (let i = 0; i < 13; ++i) {
      values.push(this.decisions[i * this.stride + frame] * this.header.decision_unit);
      if (i < 12) sum += values[i];
    }
    return sum > 0.5 ? { probabilities: values.slice(0, 12), value: values[12] } : null;
  }
  // Returns the action chosen at a frame, or null.
  action(agent, frame) {
    const next = frame + 1 < this.frames && this.episodeOf[frame + 1] === this.episodeOf[frame] ? this.raw("action", agent, frame + 1) : 0;
    return next ? next - 1 : null;
  }
  chain(agent, frame) {
    let found = null;
    for (const chain of this.episode(frame).chains[agent]) {
      if (chain.frame > frame) break;
      found = chain;
    }
    return found;
  }
  // Interpolates the pose between two frames.
  pose(agent, time) {
    const frame = Math.min(Math.floor(time), this.frames - 1), share = time - frame, next = frame + 1;
    const a = agent * this.stride + frame, { x_m, y_m, z_m, heading_deg } = this.tracks;
    const goes = share > 0 && next < this.frames && this.episodeOf[next] === this.episodeOf[frame] && !this.isAbsent(agent, next);
    const mix = track => goes ? track[a] + (track[a + 1] - track[a]) * share : track[a];
    return { x_m: mix(x_m) * this.units.x_m, y_m: mix(y_m) * this.units.y_m, z_m: mix(z_m) * this.units.z_m, heading_deg: mix(heading_deg) * this.units.heading_deg };
  }
  // Returns infractions and goals by frame: [{frame, agent, kind}].
  findEvents() {
    const found = [], events = this.tracks.events;
    for (let agent = 0, i = 0; agent < this.agents; ++agent) {
      for (let frame = 0; frame < this.frames; ++frame, ++i) if (events[i]) found.push(...eventsOf(events[i], agent, frame));
    }
    return found.sort((a, b) => a.frame - b.frame || a.agent - b.agent);
  }
}

// Images of the followed agents in the first `frames` frames, group by group.
class Images {
  constructor({ cameras, frames, images: { hues, frames_per_group: perGroup, group_bytes } }, bytes) {
    Object.assign(this, { cameras, hues, perGroup, frames: Math.min(frames, perGroup * group_bytes.length), bytes });
    this.begins = [0];
    for (const size of group_bytes) this.begins.push(this.begins.at(-1) + size);
    if (bytes.length !== this.begins.at(-1)) throw new Damaged(`expected ${this.begins.at(-1)} bytes of images, got ${bytes.length}`);
    this.frameBytes = this.cameras.reduce((sum, c) => sum + c.width_px * c.height_px * 3, 0);
    this.groups = new Map();  // group -> promise of its frames; only a few are kept
  }
  // Returns the bytes of a frame: [height, width, 3] for each camera. Prepares the next group meanwhile.
  async frame(frame) {
    const group = Math.floor(frame / this.perGroup), wanted = this.group(group);
    if (group + 2 < this.begins.length) this.group(group + 1).catch(() => {});
    const frames = await wanted;
    return frames.subarray((frame % this.perGroup) * this.frameBytes, (frame % this.perGroup + 1) * this.frameBytes);
  }
  group(group) {
    const frames = this.groups.get(group) || this.unpack(group);
    this.groups.delete(group);
    this.groups.set(group, frames);  // moves the group to the end, as the most recently used
    if (this.groups.size > 4) this.groups.delete(this.groups.keys().next().value);
    return frames;
  }
  async unpack(group) {
    const count = Math.min(this.perGroup, this.frames - group * this.perGroup);
    const work = [this.cameras, this.hues, this.bytes.slice(this.begins[group], this.begins[group + 1]), count, this.frameBytes];
    if (this.worker === undefined) this.worker = imageWorker();
    return this.worker ? this.worker(work) : unpackImages(...work);
  }
}

// Required members of a header; header_of() in replay/file.cpp writes them. A list holds the kind of its members; a
// kind that ends in "?" may be null.
const HUE = ["number"], numbers = (...names) => Object.fromEntries(names.map(name => [name, "number"]));
const HEADER = {
  command: "string", program: "string", commit: "string", map: "string", map_hash: "string", policy: "string", policy_hash: "string", light_cycles: "string", seed: "string",
  global_world: "count", dt_s: "number", agents: "count", frames: "count", lights: "count", followed: "number",
  metrics: numbers("spawned", "agent_steps", "collisions", "at_fault_collisions", "off_road", "red_light", "wall_contacts", "goals_reached", "waypoints_reached", "km_driven", "reward"),
  "first_infraction?": numbers("frame", "agent"),
  "case?": { what: "string", frame: "count", ego: "count", "removed?": "count", "inserted?": { ...numbers("length_cm", "width_cm", "height_cm", "x_cm", "y_cm", "z_cm", "heading_ddeg"), class: "count", path_cm: [["number"]] },
    answers: [{ policy: "string", ...numbers("value", "value_without", "brake", "brake_without") }] },
  conditioning: ["string"], decision_unit: "number", tracks: [{ name: "string", unit: "number", order: "count" }], sections: [{ name: "string", bytes: "count" }],
  cameras: [{ name: "string", width_px: "count", height_px: "count",
    ...numbers("focal_x_px", "focal_y_px", "center_x_px", "center_y_px", "x_m", "y_m", "z_m", "yaw_rad", "pitch_rad", "roll_rad") }],
  line_floor_px: "number", classes: [{ reference_to_center: "number", hues: [HUE] }], light_hues: [HUE],
  "images?": { frames_per_group: "count", hues: [HUE], group_bytes: ["count"] },
};

function checkHeader(header) {
  const check = (value, kind, where) => {
    const refuse = wanted => { throw new Damaged(`its header: ${where.join(".")}: expected ${wanted}, got ${value === undefined ? "no value" : JSON.stringify(value).slice(0, 40)}`); };
    if (kind === "count") { if (!Number.isInteger(value) || value < 0) refuse("a whole number"); }
    else if (typeof kind === "string") { if (typeof value !== kind) refuse(`a ${kind}`); }
    else if (Array.isArray(kind)) {
      if (!Array.isArray(value)) refuse("a list");
      value.forEach((member, i) => check(member, kind[0], [...where, i]));
    } else {
      if (typeof value !== "object" || value === null) refuse("an object");
      for (const [key, member] of Object.entries(kind)) {
        const name = key.replace("?", "");
        if (value[name] !== null || name === key) check(value[name], member, [...where, name]);
      }
    }
  };
  check(header, HEADER, []);
  const { agents, frames, followed, case: probed } = header;
  if (followed < -1 || followed >= agents) throw new Damaged(`its header: followed: expected an agent below ${agents}, got ${followed}`);
  if (probed && probed.frame >= frames) throw new Damaged(`its header: case: expected a frame below ${frames}, got ${probed.frame}`);
  if (probed && Math.max(probed.ego, probed.removed) >= agents) throw new Damaged(`its header: case: expected an agent below ${agents}`);
}

async function readReplay() {
  const text = id => {
    const element = document.getElementById(id);
    if (!element) throw new Damaged("the file is truncated; was it copied completely?");
    return element.textContent;
  };
  let header;
  try {
    header = JSON.parse(text("replay-header"));
  } catch (error) {
    if (error instanceof Damaged) throw error;
    throw new Damaged("its header cannot be read");
  }
  if (header.format !== "pictura replay") throw new Damaged("its header is not that of a replay");
  if (header.version !== 2) throw new Damaged(`its version is ${header.version}, this page reads version 2`);
  checkHeader(header);
  const whole = header.sections.reduce((sum, section) => sum + section.bytes, 0);
  try {
    const bytes = await inflated(bytesOfBase64(text("replay-data")), whole);
    return new Replay(header, bytes, header.images ? bytesOfBase64(text("replay-images")) : null);
  } catch (error) {
    if (error instanceof Damaged) throw error;
    throw new Damaged(`its numbers cannot be read (${error.message || error.name})`);
  }
}
