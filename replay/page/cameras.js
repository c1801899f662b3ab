// Images of any agent's cameras at any step, drawn with WebGL2: a counterpart of the renderer, for images that the file
// does not contain. docs/explanation/image.md has the rules; backend_gl/ uses the same method with OpenGL. A pixel is the
// mean of up to 8x8 samples.

const NEAR_M = 0.1, RANGE_M = 120, MAX_PIECE_M = 10, MAX_MITRE = 4, LIGHT_RADIUS_M = 0.5, LIGHT_SIDES = 24, RIG_BODY_M = 4.5;
const STRIP_RANKS = [2, 3, 1, 0];  // lane mark, road edge, crosswalk, stop line: the lowest rank lies above the others
// Faces of a box: front, back, left, right, top, and the underside in the top's colour. Its corners are front left,
// rear left, rear right, front right on the ground, then the same on the roof.
const BOX_FACES = [[3, 0, 4, 7], [1, 2, 6, 5], [0, 1, 5, 4], [2, 3, 7, 6], [4, 5, 6, 7], [3, 2, 1, 0]];
const FACE_FLOATS = 16, SOLID = -1;

// Vertex shader. An instance is a face of four corners in the world, in order around it, with its order among strips,
// or SOLID, and its colour. Strips have a minimum width on screen; they are compared by the depth of a plane below
// them, lower by their order.
const FACE_VERTEX_SHADER = `#version 300 es
precision highp float;
layout(location = 0) in vec4 corner0;
layout(location = 1) in vec3 corner1;
layout(location = 2) in vec3 corner2;
layout(location = 3) in vec3 corner3;
layout(location = 4) in vec3 color;
uniform vec3 eye, right, down, ahead;
uniform vec4 projection;  // scale of x and y, offset of x and y
uniform vec2 focal, positions;
uniform float floor_px;
flat out vec3 face_color;
const float near_m = float(${NEAR_M}), range_m = float(${RANGE_M});

vec3 seen(vec3 world) { vec3 d = world - eye; return vec3(dot(right, d), dot(down, d), dot(ahead, d)); }
// Cuts off the part before the near plane, so that the side leads from there to the other end.
vec3 cut(vec3 p, vec3 other) {
  return p.z >= near_m || other.z < near_m ? p : vec3(other.xy + (p.xy - other.xy) * ((other.z - near_m) / (other.z - p.z)), near_m);
}
// Returns the offset of the left corner of an end on screen; the right corner moves the opposite way.
vec2 push(vec3 left, vec3 right_corner, vec2 across) {
  if (left.z < near_m || right_corner.z < near_m) return vec2(0.0);
  float width_px = dot(focal * (left.xy / left.z - right_corner.xy / right_corner.z), across);
  float missing_px = 0.5 * max(floor_px - abs(width_px), 0.0);
  return across * (width_px < 0.0 ? -missing_px : missing_px) / focal;
}

void main() {
  vec3 p[4] = vec3[4](seen(corner0.xyz), seen(corner1), seen(corner2), seen(corner3));
  float faded = 0.0;
  for (int i = 0; i < 4; ++i) faded += 0.25 * clamp(p[i].z / range_m, 0.0, 1.0);
  face_color = color * (1.0 - faded);
  vec3 compared = vec3(0.0);
  float order = corner0.w;
  if (order >= 0.0) {
    vec3 normal = cross(p[2] - p[0], p[3] - p[1]);
    float offset = dot(normal, p[0]), above = dot(normal, vec3(right.z, down.z, ahead.z));
    offset = offset * above <= 0.0 ? offset - (0.5 + 0.2 * order) * above : offset * (1.0 - (2.0 - order) * 0.01);
    if (offset != 0.0) compared = normal / offset;
    vec3 a = p[0] + p[1], b = p[3] + p[2];
    vec2 way = focal * (b.xy * a.z - a.xy * b.z);
    float least = max(1e-6 * abs(a.z * b.z), 1e-12), size = length(way);
    vec2 across = size > least ? vec2(-way.y, way.x) / size : vec2(0.0);
    vec2 at_a = push(p[0], p[1], across), at_b = push(p[3], p[2], across);
    vec3 whole[4] = p;
    p[0] = cut(whole[0], whole[3]);
    p[1] = cut(whole[1], whole[2]);
    p[2] = cut(whole[2], whole[1]);
    p[3] = cut(whole[3], whole[0]);
    p[0].xy += at_a * p[0].z;
    p[1].xy -= at_a * p[1].z;
    p[2].xy -= at_b * p[2].z;
    p[3].xy += at_b * p[3].z;
  }
  // Two triangles of a strip cover the quadrilateral.
  vec3 at = gl_VertexID == 0 ? p[0] : gl_VertexID == 1 ? p[1] : gl_VertexID == 2 ? p[3] : p[2];
  vec2 screen = projection.xy * at.xy + projection.zw * at.z;
  // Hardware rounds corners but keeps their depths, which tilts planes, so corners are rounded here.
  if (at.z >= near_m) {
    screen = floor(screen / at.z * positions + 0.5) / positions * at.z;
    at.xy = (screen - projection.zw * at.z) / projection.xy;
  }
  float nearer = compared == vec3(0.0) ? 1.0 : clamp(dot(compared, at), 1e-4, 2.0);
  // -1 at the near plane, 1 at infinity. A face that has faded to black is not drawn.
  gl_Position = faded >= 1.0 ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(screen, at.z - 2.0 * near_m * nearer, at.z);
}`;
const FACE_FRAGMENT_SHADER = `#version 300 es
precision highp float;
flat in vec3 face_color;
out vec4 shown;
void main() { shown = vec4(face_color, 1.0); }`;

const MEAN_VERTEX_SHADER = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;
const MEAN_FRAGMENT_SHADER = `#version 300 es
precision highp float;
uniform sampler2D drawn;
uniform int grid, height;
out vec4 shown;
void main() {
  // The first row of samples belongs to the image's first row, but a canvas's first row is its last.
  ivec2 first = ivec2(gl_FragCoord.x, height - 1 - int(gl_FragCoord.y)) * grid;
  vec3 sum = vec3(0.0);
  for (int y = 0; y < grid; ++y) {
    for (int x = 0; x < grid; ++x) sum += texelFetch(drawn, first + ivec2(x, y), 0).rgb;
  }
  shown = vec4(sum / float(grid * grid), 1.0);
}`;

// Growing array of faces.
class Faces {
  constructor() { this.values = new Float32Array(FACE_FLOATS * 256); this.count = 0; }
  // Offset of the next face.
  next() {
    if ((this.count + 1) * FACE_FLOATS > this.values.length) {
      const more = new Float32Array(2 * this.values.length);
      more.set(this.values);
      this.values = more;
    }
    return this.count++ * FACE_FLOATS;
  }
  add([a, b, c, d], order, hue) {
    const to = this.next();
    this.values.set([...a, order, ...b, ...c, ...d, hue[0] / 255, hue[1] / 255, hue[2] / 255], to);
  }
  addFrom(other, face, order) {
    const to = this.next();
    this.values.set(other.values.subarray(face * FACE_FLOATS, (face + 1) * FACE_FLOATS), to);
    this.values[to + 3] = order;
  }
}

// Returns the strips of a line, as append_strips() of the renderer creates them: pieces of at most 10 m that meet in
// mitres.
function addStrips({ width_m, color, points }, faces) {
  const at = [points[0]];
  for (const b of points.slice(1)) {
    const a = at.at(-1), length = Math.hypot(b[0] - a[0], b[1] - a[1]), pieces = Math.ceil(length / MAX_PIECE_M - 1e-3);
    if (length < 1e-4) continue;
    for (let k = 1; k <= pieces; ++k) at.push(k === pieces ? b : a.map((value, i) => value + (b[i] - value) * k / pieces));
  }
  const last = at.length - 1;
  if (last < 1) return;
  const lefts = Array.from({ length: last }, (_, i) => {
    const dx = at[i + 1][0] - at[i][0], dy = at[i + 1][1] - at[i][1], length = Math.hypot(dx, dy);
    return [-dy / length, dx / length];
  });
  const mitre = (before, after) => {
    const x = before[0] + after[0], y = before[1] + after[1], scale = 2 / Math.max(x * x + y * y, 4 / MAX_MITRE ** 2);
    return [x * scale, y * scale];
  };
  const isClosed = last >= 3 && at[0].every((value, i) => value === at[last][i]);
  const seam = isClosed ? mitre(lefts[last - 1], lefts[0]) : null;
  const side = i => i === 0 ? seam ?? lefts[0] : i === last ? seam ?? lefts[last - 1] : mitre(lefts[i - 1], lefts[i]);
  const moved = (p, s, share) => [p[0] + share * s[0], p[1] + share * s[1], p[2]];
  for (let i = 0; i < last; ++i) {
    const a = side(i), b = side(i + 1), half = 0.5 * width_m;
    faces.add([moved(at[i], a, half), moved(at[i], a, -half), moved(at[i + 1], b, -half), moved(at[i + 1], b, half)], 0, color);
  }
}

// Returns right, down and forward of a camera on its body.
function axesOf({ yaw_rad, pitch_rad, roll_rad }) {
  const turns = [  // rotations about x, y and z, in this order
    ([x, y, z]) => { const c = Math.cos(roll_rad), s = Math.sin(roll_rad); return [x, c * y - s * z, s * y + c * z]; },
    ([x, y, z]) => { const c = Math.cos(-pitch_rad), s = Math.sin(-pitch_rad); return [c * x + s * z, y, c * z - s * x]; },
    ([x, y, z]) => { const c = Math.cos(yaw_rad), s = Math.sin(yaw_rad); return [c * x - s * y, s * x + c * y, z]; },
  ];
  return [[0, -1, 0], [0, 0, -1], [1, 0, 0]].map(axis => turns.reduce((turned, turn) => turn(turned), axis));
}

class CameraView {
  // Throws if the browser has no WebGL2.
  constructor(replay) {
    const { scenery, header } = replay;
    Object.assign(this, { replay, header, cameras: header.cameras, heads: scenery.heads, walls: new Faces(), targets: new Map() });
    const strips = new Faces(), ranks = [];
    for (const line of scenery.lines) {
      const before = strips.count;
      addStrips(line, strips);
      for (let i = before; i < strips.count; ++i) ranks.push(STRIP_RANKS[line.kind]);
    }
    // Strips that lie above others come first.
    const order = ranks.map((_, i) => i).sort((a, b) => ranks[a] - ranks[b] || a - b);
    this.strips = new Faces();
    for (const i of order) this.strips.addFrom(strips, i, 0);
    for (const { color, height_m, a, b } of scenery.walls) {
      this.walls.add([a, b, [b[0], b[1], b[2] + height_m], [a[0], a[1], a[2] + height_m]], SOLID, color);
    }
    this.makePipeline();
  }

  makePipeline() {
    const canvas = document.createElement("canvas"), gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false });
    if (!gl) throw new Error("this browser has no WebGL2");
    this.gl = gl;
    const program = (vertex, fragment, uniforms) => {
      const made = gl.createProgram();
      for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(type);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        gl.attachShader(made, shader);
      }
      gl.linkProgram(made);
      if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made) || "its WebGL2 rejects the shader program");
      return { program: made, ...Object.fromEntries(uniforms.map(name => [name, gl.getUniformLocation(made, name)])) };
    };
    this.face = program(FACE_VERTEX_SHADER, FACE_FRAGMENT_SHADER, ["eye", "right", "down", "ahead", "projection", "focal", "positions", "floor_px"]);
    this.mean = program(MEAN_VERTEX_SHADER, MEAN_FRAGMENT_SHADER, ["grid", "height"]);
    this.buffers = [0, 1].map(() => {
      const array = gl.createVertexArray(), buffer = gl.createBuffer();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      let offset = 0;
      [4, 3, 3, 3, 3].forEach((size, location) => {
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, size, gl.FLOAT, false, 4 * FACE_FLOATS, 4 * offset);
        gl.vertexAttribDivisor(location, 1);
        offset += size;
      });
      return { array, buffer, count: 0 };
    });
    this.nothing = gl.createVertexArray();
  }

  // Returns the framebuffer in which the samples of images of a size are drawn.
  target(width, height) {
    const key = `${width}x${height}`;
    if (this.targets.has(key)) return this.targets.get(key);
    const { gl } = this, largest = Math.min(gl.getParameter(gl.MAX_TEXTURE_SIZE), gl.getParameter(gl.MAX_RENDERBUFFER_SIZE));
    let grid = 8;
    while (grid > 1 && (grid * grid * width * height > 2 ** 21 || grid * Math.max(width, height) > largest)) grid /= 2;
    const texture = gl.createTexture(), frame = gl.createFramebuffer(), depth = gl.createRenderbuffer();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, grid * width, grid * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT32F, grid * width, grid * height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    const made = { grid, texture, frame };
    this.targets.set(key, made);
    return made;
  }

  upload(at, faces) {
    const { gl } = this, into = this.buffers[at];
    gl.bindBuffer(gl.ARRAY_BUFFER, into.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, faces.values.subarray(0, faces.count * FACE_FLOATS), gl.STREAM_DRAW);
    into.count = faces.count;
  }

  // Returns walls and strips within the visible range of a position.
  facesAround(x, y) {
    const near = new Faces(), reach = RANGE_M + 2 * MAX_PIECE_M;
    const isNear = (faces, i) => {
      const at = i * FACE_FLOATS, v = faces.values;
      return (Math.abs(v[at] - x) < reach && Math.abs(v[at + 1] - y) < reach) || (Math.abs(v[at + 7] - x) < reach && Math.abs(v[at + 8] - y) < reach);
    };
    for (let i = 0; i < this.walls.count; ++i) if (isNear(this.walls, i)) near.addFrom(this.walls, i, SOLID);
    const shown = [];
    for (let i = 0; i < this.strips.count; ++i) if (isNear(this.strips, i)) shown.push(i);
    shown.forEach((strip, i) => near.addFrom(this.strips, strip, i / shown.length));
    return near;
  }

  // Returns the boxes of a frame: {x_m, y_m, z_m, heading_deg} and a body. Boxes of `hidden` are excluded.
  boxesOf(frame, hidden, added) {
    const { replay } = this, boxes = [...replay.episode(frame).parked, ...added];
    for (let agent = 0; agent < replay.agents; ++agent) {
      if (!hidden.includes(agent) && !replay.isAbsent(agent, frame)) boxes.push({ ...replay.body(agent, frame), ...replay.pose(agent, frame) });
    }
    return boxes;
  }

  // Returns the faces of boxes and lights that are turned to a camera at `eye`.
  movingFaces(eye, boxes, frame) {
    const faces = new Faces();
    for (const box of boxes) {
      const c = Math.cos(box.heading_deg * Math.PI / 180), s = Math.sin(box.heading_deg * Math.PI / 180);
      const dx = eye[0] - box.x_m, dy = eye[1] - box.y_m, ahead = dx * c + dy * s, left = dy * c - dx * s;
      if (Math.hypot(dx, dy) > 2 * RANGE_M) continue;
      const { hues } = this.header.classes[box.agentClass], l = 0.5 * box.length_m, w = 0.5 * box.width_m, top = box.z_m + box.height_m;
      const turned = [ahead > l, ahead < -l, left > w, left < -w, eye[2] > top, eye[2] < box.z_m];
      const corners = [box.z_m, top].flatMap(z => [[l, w], [-l, w], [-l, -w], [l, -w]].map(([x, y]) => [box.x_m + x * c - y * s, box.y_m + x * s + y * c, z]));
      BOX_FACES.forEach((face, i) => { if (turned[i]) faces.add(face.map(corner => corners[corner]), SOLID, hues[Math.min(i, 4)]); });
    }
    for (const { signal, facing_rad, half_angle_rad, position: [x, y, z] } of this.heads) {
      // States with a black hue are not drawn: unknown lights, and in files of earlier versions lights that are off.
      const hue = signal < this.replay.numLights ? this.header.light_hues[this.replay.light(signal, frame)] : undefined;
      if (!hue?.some(channel => channel > 0)) continue;
      const fx = Math.cos(facing_rad), fy = Math.sin(facing_rad), dx = eye[0] - x, dy = eye[1] - y, ahead = dx * fx + dy * fy;
      const cosine = Math.max(Math.cos(half_angle_rad), 0);
      if (ahead <= 0 || ahead * ahead < cosine * cosine * (dx * dx + dy * dy)) continue;
      const turn = 2 * Math.PI / LIGHT_SIDES, radius = LIGHT_RADIUS_M * Math.sqrt(turn / Math.sin(turn));
      const corner = i => [x - fy * radius * Math.cos(i * turn), y + fx * radius * Math.cos(i * turn), z + radius * Math.sin(i * turn)];
      for (let i = 1; i + 1 < LIGHT_SIDES; i += 2) faces.add([corner(0), corner(i), corner(i + 1), corner(Math.min(i + 2, LIGHT_SIDES - 1))], SOLID, hue);
    }
    return faces;
  }

  // Draws an agent's cameras at a frame: copies the image of each into the 2D context of its size. `hidden` agents are
  // not drawn, road users in `added` are: bodies with positions.
  draw(agent, frame, { hidden = [], added = [] }, contexts) {
    const { gl, replay, header } = this, body = replay.body(agent, frame), pose = replay.pose(agent, frame);
    if (gl.isContextLost()) throw new Error("its WebGL2 context was lost");
    const c = Math.cos(pose.heading_deg * Math.PI / 180), s = Math.sin(pose.heading_deg * Math.PI / 180);
    const turned = ([x, y, z]) => [x * c - y * s, x * s + y * c, z];
    const back = header.classes[body.agentClass].reference_to_center * body.length_m, shrink = Math.min(1, body.length_m / RIG_BODY_M);
    const boxes = this.boxesOf(frame, [agent, ...hidden], added);
    this.upload(0, this.facesAround(pose.x_m, pose.y_m));
    this.cameras.forEach((camera, i) => {
      const place = turned([shrink * camera.x_m - back, camera.y_m, camera.z_m]), eye = [pose.x_m + place[0], pose.y_m + place[1], pose.z_m + place[2]];
      this.upload(1, this.movingFaces(eye, boxes, frame));
      this.drawImage(camera, eye, axesOf(camera).map(turned));
      contexts[i].drawImage(gl.canvas, 0, 0);
    });
  }

  drawImage(camera, eye, [right, down, ahead]) {
    const { gl, face, mean } = this, { width_px: width, height_px: height } = camera, { grid, texture, frame } = this.target(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, grid * width, grid * height);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(face.program);
    gl.uniform3fv(face.eye, eye);
    gl.uniform3fv(face.right, right);
    gl.uniform3fv(face.down, down);
    gl.uniform3fv(face.ahead, ahead);
    gl.uniform2f(face.focal, camera.focal_x_px, camera.focal_y_px);
    // Converts camera coordinates to -1 .. 1 across the image, whose first row is the lowest of the texture.
    gl.uniform4f(face.projection, 2 * camera.focal_x_px / width, 2 * camera.focal_y_px / height, 2 * camera.center_x_px / width - 1, 2 * camera.center_y_px / height - 1);
    const perHalf = 0.5 * grid * 2 ** gl.getParameter(gl.SUBPIXEL_BITS);
    gl.uniform2f(face.positions, perHalf * width, perHalf * height);
    gl.uniform1f(face.floor_px, this.header.line_floor_px);
    // The first of several surfaces at equal depth is kept. Order: agents, lights, walls, strips.
    for (const { array, count } of [this.buffers[1], this.buffers[0]]) {
      gl.bindVertexArray(array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    }
    if (gl.canvas.width !== width || gl.canvas.height !== height) Object.assign(gl.canvas, { width, height });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(mean.program);
    gl.uniform1i(mean.grid, grid);
    gl.uniform1i(mean.height, height);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}
