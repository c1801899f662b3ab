// Map, cached as a picture that is redrawn when the scale changes or its margin is used up.

const LANE_COLORS = ["--road", "--road", "--parking", "--road-ramp", "--side", "--sidewalk", "--green", "--green", "--side", "--side", "--side", "--side"];
const MARK_COLORS = ["--mark-white", "--mark-yellow"];
const CELL_M = 80;

// Shapes of one style, by grid cell, as paths in metres.
class Batch {
  constructor(look) { this.look = look; this.cells = new Map(); }
  add(points, closed) {
    let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
    for (let i = 0; i < points.length; i += 2) {
      x0 = Math.min(x0, points[i]); x1 = Math.max(x1, points[i]);
      y0 = Math.min(y0, points[i + 1]); y1 = Math.max(y1, points[i + 1]);
    }
    const key = `${Math.floor((x0 + x1) / 2 / CELL_M)},${Math.floor((y0 + y1) / 2 / CELL_M)}`;
    let cell = this.cells.get(key);
    if (!cell) this.cells.set(key, cell = { path: new Path2D(), box: [Infinity, Infinity, -Infinity, -Infinity] });
    points.length && cell.path.moveTo(points[0], points[1]);
    for (let i = 2; i < points.length; i += 2) cell.path.lineTo(points[i], points[i + 1]);
    if (closed) cell.path.closePath();
    const box = cell.box;
    cell.box = [Math.min(box[0], x0), Math.min(box[1], y0), Math.max(box[2], x1), Math.max(box[3], y1)];
  }
}

// Returns bars across a crosswalk's longest side.
function barsOf(points) {
  let x = 0, y = 0, longest = 0, along = [1, 0];
  const count = points.length / 2;
  for (let i = 0; i < count; ++i) {
    const j = (i + 1) % count, dx = points[2 * j] - points[2 * i], dy = points[2 * j + 1] - points[2 * i + 1], length = Math.hypot(dx, dy);
    x += points[2 * i] / count;
    y += points[2 * i + 1] / count;
    if (length > longest) { longest = length; along = [dx / length, dy / length]; }
  }
  const bars = [];
  for (let d = -longest / 2; d <= longest / 2; d += 1) {
    const mx = x + along[0] * d, my = y + along[1] * d;
    bars.push([mx - along[1] * longest, my + along[0] * longest, mx + along[1] * longest, my - along[0] * longest]);
  }
  return bars;
}

class MapView {
  constructor(shapes) {
    this.lights = [];
    this.batches = [];
    this.crosswalks = [];
    this.box = [Infinity, Infinity, -Infinity, -Infinity];
    const lines = new Map();
    const lineBatch = (key, look) => {
      if (!lines.has(key)) lines.set(key, new Batch(look));
      return lines.get(key);
    };
    let lanes = null;
    for (const { kind, detail, width_m, points } of shapes) {
      for (let i = 0; i < points.length && kind !== "light"; i += 2) {
        this.box = [Math.min(this.box[0], points[i]), Math.min(this.box[1], points[i + 1]), Math.max(this.box[2], points[i]), Math.max(this.box[3], points[i + 1])];
      }
      if (kind === "lane") {
        const color = LANE_COLORS[detail] || "--side";
        // In order: later shapes cover earlier shapes.
        if (!lanes || lanes.look.fill !== color) this.batches.push(lanes = new Batch({ fill: color }));
        lanes.add(points, true);
      } else if (kind === "crosswalk") {
        const path = new Path2D();
        for (let i = 0; i < points.length; i += 2) path.lineTo(points[i], points[i + 1]);
        path.closePath();
        this.crosswalks.push({ path, bars: barsOf(points), x: points[0], y: points[1] });
      } else if (kind === "light") {
        const [ax, ay, bx, by, x, y, fx, fy] = points;
        this.lights.push({ ax, ay, bx, by, x, y, dx: fx - x, dy: fy - y });
      } else if (kind === "marking") {
        const color = MARK_COLORS[detail] || "--mark-other";
        lineBatch(`0${color}${width_m}`, { stroke: color, width_m, least_px: 0.5, from: 0.9 }).add(points, false);
      } else if (kind === "parking_space") lineBatch("1", { stroke: "--line", width_m: 0.12, least_px: 0.5, from: 1.2 }).add(points, true);
      else if (kind === "stop_line") lineBatch("2", { stroke: "--stop", width_m: Math.max(width_m, 0.3), least_px: 0.8, from: 0.8 }).add(points, false);
      else if (kind === "road_edge") lineBatch("3", { stroke: "--edge", width_m: 0.16, least_px: 0.7, from: 0 }).add(points, false);
      else lineBatch("4", { stroke: "--wall", width_m: 0.5, least_px: 1.2, from: 0 }).add(points, false);
    }
    this.lines = [...lines.entries()].sort(([a], [b]) => (a < b ? -1 : 1)).map(([, batch]) => batch);
    if (!(this.box[0] <= this.box[2])) this.box = [-50, -50, 50, 50];
    this.canvas = document.createElement("canvas");
    this.kept = null;
  }

  forget() { this.kept = null; }

  // Draws the map behind a camera {x, y, scale: px a metre} on a canvas of this size in pixels. With `isMoving` a
  // picture of another scale is used meanwhile.
  draw(context, camera, width, height, theme, isMoving) {
    const kept = this.kept, margin = 0.25;
    const covers = kept && Math.abs(camera.x - kept.x) * camera.scale <= margin * width && Math.abs(camera.y - kept.y) * camera.scale <= margin * height;
    const fits = covers && kept.scale === camera.scale && kept.width === width && kept.height === height;
    if (!fits && !(isMoving && kept)) this.render({ ...camera, width, height }, margin, theme);
    const { x, y, scale } = this.kept, zoom = camera.scale / scale;
    const w = this.canvas.width * zoom, h = this.canvas.height * zoom;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = theme["--ground"];
    context.fillRect(0, 0, width, height);
    context.imageSmoothingEnabled = zoom !== 1;
    const left = width / 2 + (x - camera.x) * camera.scale - w / 2, top = height / 2 - (y - camera.y) * camera.scale - h / 2;
    context.drawImage(this.canvas, zoom === 1 ? Math.round(left) : left, zoom === 1 ? Math.round(top) : top, w, h);
    return fits || !isMoving;
  }

  render(view, margin, theme) {
    const { x, y, scale, width, height } = view, canvas = this.canvas;
    canvas.width = Math.ceil(width * (1 + 2 * margin));
    canvas.height = Math.ceil(height * (1 + 2 * margin));
    const context = canvas.getContext("2d", { alpha: false });
    context.fillStyle = theme["--ground"];
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(scale, 0, 0, -scale, canvas.width / 2 - x * scale, canvas.height / 2 + y * scale);
    context.lineJoin = "round";
    const hw = canvas.width / 2 / scale + 2, hh = canvas.height / 2 / scale + 2;
    const isVisible = box => box[0] <= x + hw && box[2] >= x - hw && box[1] <= y + hh && box[3] >= y - hh;
    for (const { look, cells } of this.batches) {
      context.fillStyle = context.strokeStyle = theme[look.fill];
      context.lineWidth = Math.max(0.1, 0.8 / scale);
      for (const cell of cells.values()) {
        if (!isVisible(cell.box)) continue;
        context.fill(cell.path);
        context.stroke(cell.path);  // so that adjacent cells leave no seam
      }
    }
    if (scale > 0.7) {
      context.strokeStyle = theme["--crosswalk"];
      for (const { path, bars, x: cx, y: cy } of this.crosswalks) {
        if (Math.abs(cx - x) > hw + 40 || Math.abs(cy - y) > hh + 40) continue;
        context.save();
        context.clip(path);
        context.globalAlpha = 0.75;
        context.lineWidth = 0.5;
        context.beginPath();
        for (const [ax, ay, bx, by] of bars) { context.moveTo(ax, ay); context.lineTo(bx, by); }
        context.stroke();
        context.restore();
      }
    }
    for (const { look, cells } of this.lines) {
      if (scale < look.from) continue;
      context.strokeStyle = theme[look.stroke];
      context.lineWidth = Math.max(look.width_m, look.least_px / scale);
      for (const cell of cells.values()) if (isVisible(cell.box)) context.stroke(cell.path);
    }
    this.kept = view;
  }
}
