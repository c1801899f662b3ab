// World from above: the map, lights, agents, goal chains, and the camera that viewers move.

// Colours by state; a light with an unknown state is not drawn.
const LIGHT_COLORS = ["#6b7078", "#ff3b3b", "#ffc400", "#25d366"];
const THEME = ["--ground", "--road", "--road-ramp", "--parking", "--sidewalk", "--green", "--side", "--mark-white", "--mark-yellow", "--mark-other",
  "--edge", "--wall", "--stop", "--crosswalk", "--line", "--text", "--dim", "--accent", "--panel", "--raised", "--vehicle", "--cyclist", "--pedestrian",
  "--parked", "--outline", "--collision", "--off-road", "--red-light", "--wall-contact", "--goal", "--case", "--positive", "--negative", "--font"];
const CLASS_COLORS = ["--vehicle", "--cyclist", "--pedestrian"];

function readTheme() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(THEME.map(name => [name, style.getPropertyValue(name).trim()]));
}

class WorldView {
  constructor(replay, canvas, state, legend_px) {
    Object.assign(this, { replay, canvas, state, legend_px, map: new MapView(replay.map), drawn: [], hover: null });
    this.context = canvas.getContext("2d", { alpha: false });
    this.movedAt = -Infinity;
  }

  resize() {
    const ratio = window.devicePixelRatio || 1, box = this.canvas.getBoundingClientRect();
    this.ratio = ratio;
    const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
    if (width === this.canvas.width && height === this.canvas.height) return;
    this.canvas.width = width;
    this.canvas.height = height;
  }

  // Shows the whole map, beside the legend where the legend would cover it.
  fit() {
    const [x0, y0, x1, y1] = this.map.box, width = this.canvas.width / this.ratio, height = this.canvas.height / this.ratio, { legend_px } = this;
    const zoomIn = free => 0.94 * Math.min(free / (x1 - x0), height / (y1 - y0));
    this.state.zoom = zoomIn(width);
    const isUnder = (width - (x1 - x0) * this.state.zoom) / 2 < legend_px && legend_px < width / 2;
    if (isUnder) this.state.zoom = zoomIn(width - legend_px);
    this.state.x = (x0 + x1) / 2 - (isUnder ? legend_px / 2 / this.state.zoom : 0);
    this.state.y = (y0 + y1) / 2;
  }
  zoomBy(factor, px, py) {
    const before = this.metresOf(px, py), zoom = Math.min(60, Math.max(0.05, this.state.zoom * factor));
    this.state.zoom = zoom;
    const after = this.metresOf(px, py);
    if (!this.state.follow) {
      this.state.x += before[0] - after[0];
      this.state.y += before[1] - after[1];
    }
    this.movedAt = performance.now();
  }
  get scale() { return this.state.zoom * this.ratio; }
  // Converts CSS pixels on the canvas to metres.
  metresOf(px, py) {
    const { width, height } = this.canvas;
    return [this.state.x + (px * this.ratio - width / 2) / this.scale, this.state.y - (py * this.ratio - height / 2) / this.scale];
  }
  pixelOf(x, y) {
    return [this.canvas.width / 2 + (x - this.state.x) * this.scale, this.canvas.height / 2 - (y - this.state.y) * this.scale];
  }
  // Returns the agent drawn nearest to a position in CSS pixels, or null.
  agentAt(px, py) {
    let found = null, nearest = 14 * this.ratio;
    for (const agent of this.drawn) {
      const reach = Math.hypot(agent.px - px * this.ratio, agent.py - py * this.ratio) - 0.4 * agent.length_px;
      if (reach < nearest) { nearest = reach; found = agent.agent; }
    }
    return found;
  }

  // Draws the world. Returns false if the map is only a temporary picture.
  draw(theme) {
    const { replay, state, context } = this, { width, height } = this.canvas;
    const time = state.time, frame = Math.floor(time);
    if (state.follow && !replay.isAbsent(state.agent, frame)) {
      const pose = replay.pose(state.agent, time);
      state.x = pose.x_m;
      state.y = pose.y_m;
    }
    const isMoving = performance.now() - this.movedAt < 120;
    const camera = { x: state.x, y: state.y, scale: this.scale };
    const isFinal = this.map.draw(context, camera, width, height, theme, isMoving);
    this.drawLights(frame, theme);
    this.drawn = [];
    const bodies = replay.episode(frame).bodies;
    for (const car of replay.episode(frame).parked) this.drawBox(car, car, theme["--parked"], theme, 0.8);
    if (state.goals) this.drawGoals(time, frame, theme);
    if (!replay.isAbsent(state.agent, frame)) {
      this.drawTrail(time, frame, theme);
      this.drawChain(time, frame, theme);
    }
    for (let agent = 0; agent < replay.agents; ++agent) {
      if (replay.isAbsent(agent, frame)) continue;
      const pose = replay.pose(agent, time), body = bodies[agent], [px, py] = this.pixelOf(pose.x_m, pose.y_m);
      const isHalted = replay.raw("status", agent, frame) === HALTED;
      const length_px = Math.max(body.length_m * this.scale, 7 * this.ratio);
      this.drawn.push({ agent, ...pose, px, py, length_px });
      if (px < -60 || py < -60 || px > width + 60 || py > height + 60) continue;
      if (agent === state.agent) this.drawHalo(px, py, length_px, theme);
      this.drawBox(pose, body, theme[CLASS_COLORS[body.agentClass]], theme, isHalted ? 0.6 : 1);
      if (isHalted) this.drawHalt(px, py, length_px, replay.raw("halt_reason", agent, frame), theme);
      if (state.numbers || agent === state.agent || this.scale / this.ratio > 9) this.drawNumber(agent, px, py, length_px, theme);
    }
    if (replay.probed) this.drawCase(time, frame, theme);
    return isFinal;
  }

  // Draws the road user of a probe's case, joined with its ego in the case's step; in other steps only its position.
  drawCase(time, frame, theme) {
    const { replay, context, ratio } = this, { ego, removed, inserted } = replay.probed, isNow = frame === replay.probed.frame;
    const isThere = agent => agent !== null && !replay.isAbsent(agent, frame);
    const pose = inserted ? { x_m: inserted.x_cm / 100, y_m: inserted.y_cm / 100, heading_deg: inserted.heading_ddeg / 10 } : isThere(removed) ? replay.pose(removed, time) : null;
    if (!pose) return;
    const body = inserted ? { agentClass: inserted.class, length_m: inserted.length_cm / 100, width_m: inserted.width_cm / 100 } : replay.body(removed, frame);
    const [px, py] = this.pixelOf(pose.x_m, pose.y_m), radius = 0.7 * Math.max(body.length_m * this.scale, 7 * ratio) + 5 * ratio;
    context.strokeStyle = theme["--case"];
    context.lineWidth = 2 * ratio;
    context.globalAlpha = isNow ? 1 : 0.5;
    context.setLineDash([4 * ratio, 4 * ratio]);
    if (inserted && isNow) {
      context.beginPath();
      for (const [x, y] of inserted.path_cm) context.lineTo(...this.pixelOf(x / 100, y / 100));
      context.stroke();
    }
    if (isNow && isThere(ego)) {
      const from = replay.pose(ego, time);
      context.beginPath();
      context.moveTo(...this.pixelOf(from.x_m, from.y_m));
      context.lineTo(px, py);
      context.stroke();
    }
    context.setLineDash([]);
    if (inserted) this.drawBox(pose, body, theme[CLASS_COLORS[body.agentClass]], theme, isNow ? 1 : 0.4);
    context.globalAlpha = isNow ? 1 : 0.5;
    context.beginPath();
    context.arc(px, py, radius, 0, 2 * Math.PI);
    if (!inserted) {  // crossed out
      context.moveTo(px - 0.7 * radius, py + 0.7 * radius);
      context.lineTo(px + 0.7 * radius, py - 0.7 * radius);
    }
    context.stroke();
    this.drawLabel(inserted ? "inserted" : `${removed}: removed`, px + radius + 4 * ratio, py + 0.7 * radius, theme, "--case");
    context.globalAlpha = 1;
  }

  drawLights(frame, theme) {
    const { context, scale } = this;
    context.lineCap = "butt";
    this.map.lights.forEach((light, i) => {
      const color = i < this.replay.numLights ? LIGHT_COLORS[this.replay.light(i, frame)] : undefined;
      if (!color) return;
      const [ax, ay] = this.pixelOf(light.ax, light.ay), [bx, by] = this.pixelOf(light.bx, light.by), [x, y] = this.pixelOf(light.x, light.y);
      context.strokeStyle = color;
      context.lineWidth = Math.max(0.7 * scale, 2 * this.ratio);
      context.beginPath();
      context.moveTo(ax, ay);
      context.lineTo(bx, by);
      context.stroke();
      const radius = Math.max(0.6 * scale, 2 * this.ratio);
      if (scale / this.ratio < 1.2) return;
      context.fillStyle = "#15181d";
      context.beginPath();
      context.moveTo(x + light.dy * radius, y + light.dx * radius);
      context.lineTo(x + light.dx * 2.6 * radius, y - light.dy * 2.6 * radius);
      context.lineTo(x - light.dy * radius, y - light.dx * radius);
      context.fill();
      this.disk(x, y, 1.35 * radius, "#15181d");
      this.disk(x, y, radius, color);
    });
  }
  disk(x, y, radius, color) {
    this.context.fillStyle = color;
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    this.context.fill();
  }

  drawBox(pose, body, color, theme, alpha) {
    const { context, scale, ratio } = this, [px, py] = this.pixelOf(pose.x_m, pose.y_m);
    if (px < -60 || py < -60 || px > this.canvas.width + 60 || py > this.canvas.height + 60) return;
    const grow = Math.max(1, 7 * ratio / (body.length_m * scale), 2.6 * ratio / (body.width_m * scale));
    const length = body.length_m * scale * grow, width = body.width_m * scale * grow, angle = -pose.heading_deg * Math.PI / 180;
    context.save();
    context.translate(px, py);
    context.rotate(angle);
    context.globalAlpha = alpha;
    context.fillStyle = color;
    context.strokeStyle = theme["--outline"];
    context.lineWidth = ratio;
    context.beginPath();
    const r = Math.min(width, length) * 0.22;
    // Rounded, with a tip in its heading.
    context.moveTo(-length / 2 + r, -width / 2);
    context.lineTo(length * 0.28, -width / 2);
    context.quadraticCurveTo(length / 2, -width / 2, length / 2, 0);
    context.quadraticCurveTo(length / 2, width / 2, length * 0.28, width / 2);
    context.lineTo(-length / 2 + r, width / 2);
    context.quadraticCurveTo(-length / 2, width / 2, -length / 2, width / 2 - r);
    context.lineTo(-length / 2, -width / 2 + r);
    context.quadraticCurveTo(-length / 2, -width / 2, -length / 2 + r, -width / 2);
    context.closePath();
    context.fill();
    context.stroke();
    if (length > 14 * ratio && body.agentClass === 0) {  // windscreen
      context.fillStyle = theme["--outline"];
      context.globalAlpha = 0.45 * alpha;
      context.fillRect(length * 0.1, -width * 0.36, length * 0.13, width * 0.72);
    }
    context.restore();
  }
  drawHalo(px, py, length_px, theme) {
    const { context } = this;
    context.globalAlpha = 0.22;
    this.disk(px, py, 0.75 * length_px + 5 * this.ratio, theme["--accent"]);
    context.globalAlpha = 1;
    context.strokeStyle = theme["--accent"];
    context.lineWidth = 2 * this.ratio;
    context.beginPath();
    context.arc(px, py, 0.75 * length_px + 5 * this.ratio, 0, 2 * Math.PI);
    context.stroke();
  }
  // Draws a ring in the colours of the reasons.
  drawHalt(px, py, length_px, bits, theme) {
    const { context } = this, reasons = reasonsOf(bits), radius = 0.55 * length_px + 2 * this.ratio;
    context.lineWidth = 2.4 * this.ratio;
    reasons.forEach((reason, i) => {
      context.strokeStyle = theme[reason.color];
      context.beginPath();
      context.arc(px, py, radius, 2 * Math.PI * i / reasons.length, 2 * Math.PI * (i + 1) / reasons.length);
      context.stroke();
    });
  }
  drawNumber(agent, px, py, length_px, theme) {
    this.drawLabel(agent, px + 0.6 * length_px + 4 * this.ratio, py - 0.5 * length_px - 2 * this.ratio, theme, "--text");
  }
  drawLabel(text, x, y, theme, color) {
    const { context } = this;
    context.font = `600 ${11 * this.ratio}px ${theme["--font"]}`;
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.lineWidth = 3 * this.ratio;
    context.strokeStyle = theme["--outline"];
    context.fillStyle = theme[color];
    context.strokeText(text, x, y);
    context.fillText(text, x, y);
  }

  drawGoals(time, frame, theme) {
    const { context, replay } = this;
    context.strokeStyle = theme["--goal"];
    context.lineWidth = this.ratio;
    context.globalAlpha = 0.55;
    context.beginPath();
    const ends = [];
    for (let agent = 0; agent < replay.agents; ++agent) {
      const chain = replay.raw("status", agent, frame) === 0 ? replay.chain(agent, frame) : null;
      if (!chain) continue;
      const next = replay.raw("next_waypoint", agent, frame), pose = replay.pose(agent, time);
      const end = this.pixelOf(chain.x_m[next], chain.y_m[next]);
      context.moveTo(...this.pixelOf(pose.x_m, pose.y_m));
      context.lineTo(...end);
      ends.push(end);
    }
    context.stroke();
    for (const [x, y] of ends) this.disk(x, y, 2.5 * this.ratio, theme["--goal"]);
    context.globalAlpha = 1;
  }
  drawTrail(time, frame, theme) {
    const { context, replay, state } = this, oldest = Math.max(replay.episode(frame).first, frame - 60);
    let first = frame;
    while (first > oldest && !replay.isAbsent(state.agent, first - 1)) --first;
    context.lineWidth = 2.5 * this.ratio;
    context.lineCap = "butt";  // overlapping ends would show
    context.strokeStyle = theme["--accent"];
    for (let at = first; at < frame; at += 6) {
      context.globalAlpha = 0.1 + 0.5 * (at - first) / 60;
      context.beginPath();
      for (let i = at; i <= Math.min(at + 6, frame); ++i) {
        const pose = replay.pose(state.agent, i);
        context.lineTo(...this.pixelOf(pose.x_m, pose.y_m));
      }
      context.stroke();
    }
    context.globalAlpha = 1;
  }
  drawChain(time, frame, theme) {
    const { context, replay, state, ratio } = this, chain = replay.chain(state.agent, frame);
    if (!chain || replay.raw("status", state.agent, frame) !== 0) return;
    const next = replay.raw("next_waypoint", state.agent, frame), pose = replay.pose(state.agent, time);
    const places = [[pose.x_m, pose.y_m]];
    for (let i = next; i < 3; ++i) places.push([chain.x_m[i], chain.y_m[i]]);
    context.strokeStyle = theme["--goal"];
    context.lineWidth = 1.6 * ratio;
    context.setLineDash([6 * ratio, 5 * ratio]);
    context.beginPath();
    for (const place of places) context.lineTo(...this.pixelOf(...place));
    context.stroke();
    context.setLineDash([]);
    for (let i = 0; i < 3; ++i) {
      const [x, y] = this.pixelOf(chain.x_m[i], chain.y_m[i]);
      context.globalAlpha = i < next ? 0.35 : 1;
      this.disk(x, y, (i === 2 ? 8 : 6) * ratio, theme["--goal"]);
      context.fillStyle = theme["--outline"];
      context.font = `700 ${9 * ratio}px ${theme["--font"]}`;
      context.textAlign = "center";
      context.textBaseline = "middle";
      context.fillText(i + 1, x, y + 0.5 * ratio);
    }
    context.globalAlpha = 1;
  }
}
