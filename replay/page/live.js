// Replay that grows while a world runs elsewhere, and the connection to that world.

const MAX_LIVE_FRAMES = 8192, LIVE_PICTURES = 600;
// An EventSource does not report why it is refused. The number is kMaxLivePages of replay/server.h.
const REFUSED = "8 pages are already connected, or the simulation has ended";

class Refused extends Error {}

class LiveReplay extends Replay {
  static async of({ step, header, data, images }) {
    const size = header.sections.reduce((sum, section) => sum + section.bytes, 0);
    return new LiveReplay(header, await inflated(bytesOfBase64(data), size), step, images);
  }
  constructor(header, bytes, step, sendsImages) {
    super(header, bytes, null);
    Object.assign(this, { firstStep: step, looks: new Map(), version: 0, watched: -1, sendsImages, imageSource: "drawn by the simulation" });
    this.grow(512);
  }
  // Restarts, for views that hold this object, after the page has missed steps.
  restart(other) {
    const version = this.version + 1, map = this.map;
    Object.assign(this, other, { version, map });
  }
  // Moves all columns into new columns with room for `stride` frames, without the first `dropped` frames.
  move(stride, dropped) {
    const kept = this.frames - dropped;
    const moved = (column, count) => {
      const to = new Int32Array(count * stride);
      for (let i = 0; i < count; ++i) to.set(column.subarray(i * this.stride + dropped, i * this.stride + this.frames), i * stride);
      return to;
    };
    for (const name of Object.keys(this.tracks)) this.tracks[name] = moved(this.tracks[name], this.agents);
    this.lights = moved(this.lights, this.numLights);
    const episodeOf = new Uint16Array(stride);
    episodeOf.set(this.episodeOf.subarray(dropped, this.frames));
    Object.assign(this, { episodeOf, stride, frames: kept });
  }
  grow(stride) { this.move(Math.max(stride, this.stride), 0); }
  // Discards the oldest frames.
  drop(count) {
    this.move(this.stride, count);
    this.firstStep += count;
    const gone = this.episodeOf[0];
    this.episodes.splice(0, gone);
    for (let i = 0; i < this.frames; ++i) this.episodeOf[i] -= gone;
    for (const episode of this.episodes) {
      episode.first = Math.max(0, episode.first - count);
      episode.end -= count;
      episode.frames = episode.end - episode.first;
      for (const chains of episode.chains) for (const chain of chains) chain.frame -= count;
    }
    this.events = this.events.filter(event => event.frame >= count).map(event => ({ ...event, frame: event.frame - count }));
    this.looks = new Map([...this.looks].filter(([frame]) => frame >= count).map(([frame, look]) => [frame - count, look]));
  }
  // Adds the frame of a message. Returns the number of frames dropped for it, or null if the frame does not follow the
  // last one.
  append({ step, tracks, lights, chains, episode, entered, metrics }) {
    if (step !== this.firstStep + this.frames) return null;
    let dropped = 0;
    if (this.frames === this.stride) {
      if (this.stride < MAX_LIVE_FRAMES) this.grow(2 * this.stride);
      else this.drop(dropped = MAX_LIVE_FRAMES / 4);
    }
    const frame = this.frames++;
    this.header.tracks.forEach(({ name }, i) => {
      for (let agent = 0; agent < this.agents; ++agent) this.tracks[name][agent * this.stride + frame] = tracks[i][agent];
    });
    lights.forEach((light, i) => { this.lights[i * this.stride + frame] = light; });
    if (episode) this.episodes.push(this.episodeFrom(episode, frame));
    const now = this.episodes.at(-1);
    now.end = frame + 1;
    now.frames = now.end - now.first;
    this.episodeOf[frame] = this.episodes.length - 1;
    for (const [agent, ...values] of entered) {
      now.bodies[agent] = this.bodyFrom(values);
      const count = this.header.conditioning.length;
      for (let i = 0; i < count; ++i) now.conditioning[agent * count + i] = values[4 + i];
    }
    for (const [agent, ...cm] of chains) {
      const m = cm.map(value => value / 100), chain = { frame, x_m: m.slice(0, 3), y_m: m.slice(3, 6) }, before = now.chains[agent].at(-1);
      if (!before || before.x_m.some((x, i) => x !== chain.x_m[i]) || before.y_m.some((y, i) => y !== chain.y_m[i])) now.chains[agent].push(chain);
    }
    for (let agent = 0; agent < this.agents; ++agent) this.events.push(...eventsOf(this.raw("events", agent, frame), agent, frame));
    this.header.metrics = metrics;
    ++this.version;
    return dropped;
  }
  bodyFrom([agentClass, length, width, height]) { return { agentClass, length_m: length / 100, width_m: width / 100, height_m: height / 100 }; }
  episodeFrom({ index, bodies, parked, conditioning }, first) {
    return { index, first, conditioning, bodies: bodies.map(this.bodyFrom), chains: bodies.map(() => []),
      parked: parked.map(car => ({ ...this.bodyFrom(car), x_m: car[4] / 100, y_m: car[5] / 100, z_m: car[6] / 100, heading_deg: car[7] / 10 })) };
  }
  // Sets the watched agent's images and its policy's response at a step.
  addLook({ step, agent, decision, images }) {
    const frame = step - this.firstStep;
    if (frame < 0 || frame >= this.frames) return;
    this.looks.set(frame, { agent, decision, images: images && bytesOfBase64(images) });
    if (this.looks.has(frame - LIVE_PICTURES)) this.looks.get(frame - LIVE_PICTURES).images = null;
    if (decision) this.decisions = true;
    this.watched = agent;
    ++this.version;
  }
  // A frame whose look has not arrived yet is assumed to be the watched agent's.
  isFollowed(agent, frame) { return (this.looks.get(frame)?.agent ?? this.watched) === agent; }
  // True also for images that have not arrived yet.
  hasImages(agent, frame) { return Boolean(this.sendsImages && this.isFollowed(agent, frame) && (this.looks.get(frame)?.images ?? !this.looks.has(frame))); }
  // Reads the present looks, which restart() and drop() replace.
  async imagesOf(frame) { return this.looks.get(frame)?.images ?? null; }
  decision(agent, frame) {
    const look = this.looks.get(frame);
    return look?.agent === agent ? look.decision : null;
  }
}

const DRIVING_KEYS = { w: "forward", s: "backward", a: "left", d: "right", " ": "stop",
  ArrowUp: "forward", ArrowDown: "backward", ArrowLeft: "left", ArrowRight: "right" };

// Server-sent events from this page's server, and requests to the server.
class LiveConnection {
  constructor(on) {
    Object.assign(this, { on, state: "connecting", paused: false, pace: 1, driven: -1, mine: -1, isMine: false, held: new Set(), sending: Promise.resolve() });
  }
  // Resolves with the replay once the server has described the world; rejects if it cannot.
  begin() {
    return new Promise((resolve, reject) => {
      const source = this.source = new EventSource("events");
      const giveUp = error => { this.close(); reject(error); };
      // Processes messages in order, because unpacking the first message takes time.
      let work = Promise.resolve();
      const listen = (name, act) => source.addEventListener(name, event => {
        work = work.then(() => act(JSON.parse(event.data))).catch(error => this.replay ? this.on.fault(error) : giveUp(error));
      });
      listen("begin", async message => {
        const replay = await LiveReplay.of(message);
        this.state = "live";
        if (!this.replay) resolve(this.replay = replay);
        else this.replay.restart(replay);
        this.on.restart();
      });
      listen("frame", message => {
        const dropped = this.replay.append(message);
        if (dropped !== null) this.on.frame(dropped);
      });
      listen("look", message => { this.replay.addLook(message); this.on.change(); });
      listen("status", ({ paused, pace, driven }) => {
        Object.assign(this, { paused, pace, driven });
        // Another page took over driving, unless the request is still pending.
        if (driven === this.mine) this.isMine = true;
        else if (this.isMine) this.mine = -1;
        this.on.change();
      });
      listen("end", () => { this.state = "ended"; source.close(); this.on.change(); });
      source.addEventListener("error", () => {
        if (this.state === "ended") return;
        // A lost connection is retried.
        const isRefused = source.readyState === EventSource.CLOSED;
        if (isRefused && !this.replay) { giveUp(new Refused(REFUSED)); return; }
        this.state = isRefused ? "refused" : "lost";
        this.on.change();
      });
      this.timer = setInterval(() => { if (this.mine >= 0) this.sendKeys(); }, 250);
    });
  }
  // A page that cannot show the world leaves its slot to another page.
  close() {
    this.source?.close();
    clearInterval(this.timer);
  }
  ask(request) {
    if (this.state === "ended") return;
    this.sending = this.sending.then(() => fetch("control", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(request) }))
      .catch(() => {});  // the events report a lost connection
  }
  sendKeys() { this.ask({ keys: [...new Set([...this.held].map(key => DRIVING_KEYS[key]))] }); }
  drive(agent) {
    this.mine = agent;
    this.isMine = false;
    this.held.clear();
    this.ask({ drive: agent });
  }
  // Whether the key drives now.
  key(key, isDown) {
    if (this.mine < 0 || !DRIVING_KEYS[key]) return false;
    const known = this.held.has(key);
    if (isDown) this.held.add(key);
    else this.held.delete(key);
    if (known !== isDown) this.sendKeys();
    return true;
  }
  release() {
    if (!this.held.size) return;
    this.held.clear();
    this.sendKeys();
  }
}
