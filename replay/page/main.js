// The page: state, playback, keys, pointers, and the view's state in the address.

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];

function fail(message) {
  const box = byId("message"), what = byId("replay-live") ? "This page cannot show the simulation" : "This replay is damaged";
  box.className = "error";
  box.replaceChildren(make("p", `${what}: ${message}.`));
  box.hidden = false;
  byId("app").hidden = true;
}

async function main() {
  // Handlers of early events, before views exist: they do nothing.
  const live = byId("replay-live") && new LiveConnection({ fault: error => { throw error; }, restart() {}, frame() {}, change() {} });
  if (live) byId("message").firstElementChild.textContent = "Waiting for the simulation ...";
  try {
    show(await (live ? live.begin() : readReplay()), live);
  } catch (error) {
    if (live) live.close();
    const isForeseen = error instanceof Damaged || error instanceof Refused;
    fail(isForeseen ? error.message.replace(/\.$/, "") : `a part of it cannot be shown (${error.message})`);
    window.pictura = { damaged: error.message };
    if (!isForeseen) console.error(error);  // includes the position in the code
  }
}

// Creates the views, and plays. Throws if views cannot be created from the replay.
function show(replay, live) {
  // Files of earlier versions lack the map's origin.
  const header = replay.header, last = () => replay.frames - 1, origin = header.origin_m ?? [0, 0, 0];
  byId("message").hidden = true;
  byId("app").hidden = false;

  const state = { time: replay.probed?.frame ?? 0, agent: Math.max(0, replay.followed), speed: 1, playing: false, follow: false, goals: false, numbers: false,
    onlyAgent: false, camera: "", isWithout: false, x: 0, y: 0, zoom: 1, isAtEdge: Boolean(live) };
  let theme = readTheme(), isDirty = true;
  const dirty = () => { isDirty = true; };
  const clampFrame = frame => Math.min(last(), Math.max(0, frame));

  const counts = [];  // counts in the legend

  const actions = {
    // In a running world, the page continues at the newest frame.
    seek(frame) {
      state.time = clampFrame(frame);
      if (live) state.isAtEdge = state.time >= last();
      dirty();
    },
    select(agent) {
      state.agent = Math.min(replay.agents - 1, Math.max(0, agent));
      if (live) live.ask({ watch: state.agent });
      dirty();
    },
    // Shows an event: its step and its agent, moved into view if necessary.
    goTo(event) {
      actions.select(event.agent);
      actions.seek(event.frame);
      actions.show(event.agent);
    },
    // Moves the view to show an agent. An absent agent has no position.
    show(agent) {
      if (replay.isAbsent(agent, Math.floor(state.time))) return;
      const pose = replay.pose(agent, state.time), [px, py] = world.pixelOf(pose.x_m, pose.y_m), edge = 40 * world.ratio;
      const isIn = px > edge && py > edge && px < world.canvas.width - edge && py < world.canvas.height - edge;
      if (!isIn) { state.x = pose.x_m; state.y = pose.y_m; }
      if (state.zoom < 2) { state.zoom = 4; state.x = pose.x_m; state.y = pose.y_m; }
      dirty();
    },
    // Shows a probe's case: its ego and the road user, both on screen.
    showCase() {
      const { ego, removed, inserted } = replay.probed;
      actions.select(ego);
      actions.seek(replay.probed.frame);
      const a = replay.pose(ego, state.time), b = inserted ? { x_m: inserted.x_cm / 100, y_m: inserted.y_cm / 100 } : replay.pose(removed ?? ego, state.time);
      const size = Math.min(world.canvas.width, world.canvas.height) / world.ratio;
      Object.assign(state, { follow: false, x: (a.x_m + b.x_m) / 2, y: (a.y_m + b.y_m) / 2, zoom: Math.min(12, 0.5 * size / Math.max(1, Math.hypot(a.x_m - b.x_m, a.y_m - b.y_m))) });
      dirty();
    },
    camera(name) { state.camera = name; dirty(); },
    play(playing) {
      if (live) {
        live.ask({ paused: !playing });
        if (playing) state.isAtEdge = true;
      } else if (playing && state.time >= last()) state.time = 0;
      state.playing = playing;
      dirty();
    },
    speed(speed) {
      state.speed = speed;
      if (live) live.ask({ pace: live.pace = speed });
      dirty();
    },
    // In a running world, drives the chosen agent by the keys, or returns it to its driver.
    drive(isDriving) {
      live.drive(isDriving ? state.agent : -1);
      if (isDriving) { actions.follow(true); actions.play(true); }
      dirty();
    },
    follow(follow) { state.follow = follow; if (follow) state.zoom = Math.max(state.zoom, 5); dirty(); },
    fail,
  };
  fillLegend();
  const world = new WorldView(replay, byId("world"), state, byId("legend").offsetLeft + byId("legend").offsetWidth);
  const panel = new Panel(replay, state, actions);
  const timeline = new Timeline(replay, state, byId("timeline"), byId("timeline-tip"), actions);

  world.resize();
  world.fit();
  if (replay.probed) actions.showCase();
  for (const element of document.querySelectorAll(".case-only")) element.hidden = !replay.probed;

  // Address.
  function readAddress() {
    const values = new URLSearchParams(location.hash.slice(1)), number = name => values.has(name) && Number.isFinite(Number(values.get(name))) ? Number(values.get(name)) : null;
    if (!live && number("step") !== null) state.time = clampFrame(number("step"));
    if (number("agent") !== null) state.agent = Math.min(replay.agents - 1, Math.max(0, Math.round(number("agent"))));
    if (!live && SPEEDS.includes(number("speed"))) state.speed = number("speed");
    if (number("zoom") > 0) state.zoom = Math.min(60, Math.max(0.05, number("zoom")));
    if (number("x") !== null && number("y") !== null) { state.x = number("x"); state.y = number("y"); }
    else if (number("zoom") > 0 && !replay.isAbsent(state.agent, Math.floor(state.time))) ({ x_m: state.x, y_m: state.y } = replay.pose(state.agent, state.time));
    state.follow = values.get("follow") === "1";
    if (values.get("goals") === "1") state.goals = true;
    state.camera = header.cameras.some(c => c.name === values.get("camera")) ? values.get("camera") : "";
    state.isWithout = values.get("without") === "1";
    dirty();
  }
  let written = location.hash, writtenAt = 0;
  function writeAddress() {
    const values = new URLSearchParams({ step: Math.round(state.time), agent: state.agent, speed: state.speed, zoom: state.zoom.toPrecision(4) });
    if (state.follow) values.set("follow", "1");
    else { values.set("x", state.x.toFixed(1)); values.set("y", state.y.toFixed(1)); }
    if (state.goals) values.set("goals", "1");
    if (state.camera) values.set("camera", state.camera);
    if (state.isWithout) values.set("without", "1");
    const hash = `#${values}`;
    if (hash === written) return;
    written = hash;
    try { history.replaceState(null, "", hash); } catch { /* a browser that allows no more changes now */ }
  }
  window.addEventListener("hashchange", () => { if (location.hash !== written) { written = location.hash; readAddress(); } });

  // Header.
  function fillMetrics() {
    const m = replay.header.metrics;
    const shown = [["km", m.km_driven.toFixed(1)], ["goals", m.goals_reached], ["collisions", m.collisions], ["off road", m.off_road], ["red lights", m.red_light], ["walls", m.wall_contacts]];
    // Numbers count agents that act. In a recording that is only played, no agent acts.
    if (!live && m.agent_steps === 0) { byId("metrics").replaceChildren(make("li", "as recorded: no agent acts")); return; }
    byId("metrics").replaceChildren(...shown.map(([name, value]) => {
      const item = make("li");
      item.append(make("b", value), ` ${name}`);
      return item;
    }));
  }
  function fillHeader() {
    byId("map-name").textContent = header.map;
    byId("policy-name").textContent = `${policyName(header)}, ${worldName(header)}`;
    byId("policy-name").title = header.policy;
    fillMetrics();
    const command = make("code", header.command), about = byId("about").querySelector("dl");
    const facts = [["Command", command], ["Policy", header.policy], ["Policy's hash", header.policy_hash], ["Map", header.map], ["Map's hash", header.map_hash], ["Map's origin", origin.map(metres => metres.toFixed(2)).join(", ") + " m"], ["Traffic lights", header.light_cycles], ["Seed", header.seed],
      ["World", header.global_world], ["Agents", replay.agents], ["Steps", live ? `of ${header.dt_s.toFixed(2)} s` : `${last()} of ${header.dt_s.toFixed(2)} s`], ...(live ? [] : [["Episodes", replay.episodes.length]]),
      ["Commit", header.commit], ["Program", header.program], ["Quantised to", "1 cm, 0.1 degree, 1 cm/s"],
      ...(live ? [] : Object.entries(header.metrics).map(([name, value]) => [name.replace(/_/g, " "), Number(value.toFixed(3))]))];
    about.replaceChildren(...facts.flatMap(([name, value]) => {
      const text = make("dd");
      text.append(value);
      return [make("dt", name), text];
    }));
  }
  function fillLegend() {
    const row = (name, color, ring) => {
      const line = make("div"), dot = make("span", undefined, ring ? "dot ring" : "dot"), count = make("b");
      dot.style.color = `var(${color})`;
      line.append(dot, name, count);
      byId("legend").append(line);
      counts.push(count);
    };
    ["vehicles", "cyclists", "pedestrians"].forEach((name, i) => row(name, CLASS_COLORS[i]));
    row("parked", "--parked");
    byId("legend").append(make("hr"));
    KINDS.slice(0, 4).forEach(kind => row(`halted: ${kind.name}`, kind.color, true));
  }
  let counted = -1;
  function countAgents(frame) {
    if (counted === frame) return;
    counted = frame;
    const sums = counts.map(() => 0), bodies = replay.episode(frame).bodies;
    for (let agent = 0; agent < replay.agents; ++agent) {
      if (replay.isAbsent(agent, frame)) continue;
      ++sums[bodies[agent].agentClass];
      if (replay.raw("status", agent, frame) !== HALTED) continue;
      const bits = replay.raw("halt_reason", agent, frame);
      KINDS.slice(0, 4).forEach((kind, i) => { if (bits & kind.bit) ++sums[4 + i]; });
    }
    sums[3] = replay.episode(frame).parked.length;
    sums.forEach((sum, i) => { counts[i].textContent = sum; });
  }
  function drawScale() {
    const wish = 110 / state.zoom, power = 10 ** Math.floor(Math.log10(wish)), metres = [5, 2, 1].map(k => k * power).find(k => k <= wish);
    const bar = byId("scale").firstElementChild;
    bar.style.width = `${metres * state.zoom}px`;
    bar.textContent = metres >= 1000 ? `${metres / 1000} km` : `${metres} m`;
  }

  // Playing.
  let before = 0;
  function frame(now) {
    const elapsed_s = Math.min(0.25, (now - before) / 1000);
    before = now;
    if (live) {
      state.speed = live.pace;
      state.playing = state.isAtEdge && !live.paused && live.state === "live";
      const lag = last() - state.time;
      if (state.isAtEdge && lag > 0) {
        // Plays about a step behind the newest frame, so that there is a frame to move towards; faster if far behind.
        state.time = lag > 6 ? last() - 1 : Math.min(last(), state.time + elapsed_s * state.speed / replay.dt_s * lag);
        if (!state.playing && lag < 0.02) state.time = last();
        isDirty = true;
      }
    } else if (state.playing) {
      state.time = Math.min(last(), state.time + elapsed_s * state.speed / replay.dt_s);
      if (state.time >= last()) state.playing = false;
      isDirty = true;
    }
    if (isDirty) {
      isDirty = !render();
      if (now - writtenAt > 300) { writtenAt = now; writeAddress(); }
      else isDirty = isDirty || !state.playing;
    }
    requestAnimationFrame(frame);
  }
  function render() {
    world.resize();
    const at = Math.floor(state.time), isFinal = world.draw(theme);
    panel.draw(theme, world.ratio);
    timeline.draw(theme, world.ratio);
    countAgents(at);
    drawScale();
    byId("clock").textContent = `${((replay.firstStep + at) * replay.dt_s).toFixed(1)} s, step ${replay.firstStep + at}` + (live ? `, episode ${replay.episode(at).index + 1}` : ` of ${last()}` + (replay.episodes.length > 1 ? `, episode ${replay.episodeOf[at] + 1} of ${replay.episodes.length}` : ""));
    if (live) showLive();
    byId("play").textContent = state.playing ? "Pause" : "Play";
    byId("speed").value = String(state.speed);
    byId("follow").setAttribute("aria-pressed", state.follow);
    return isFinal;
  }

  // Buttons.
  const on = (id, act) => byId(id).addEventListener("click", () => { act(); dirty(); });
  on("play", () => actions.play(!state.playing));
  on("step-back", () => step(-1));
  on("step-on", () => step(1));
  on("agent-before", () => step_agent(-1));
  on("agent-after", () => step_agent(1));
  on("follow", () => actions.follow(!state.follow));
  on("zoom-in", () => zoom(1.5));
  on("zoom-out", () => zoom(1 / 1.5));
  on("fit", () => fit());
  on("user-shown", () => switchUser());
  on("about-button", () => toggle("about"));
  on("help-button", () => toggle("help"));
  byId("speed").addEventListener("change", event => actions.speed(Number(event.target.value)));
  byId("only-agent").addEventListener("change", event => { state.onlyAgent = event.target.checked; dirty(); });
  byId("search").addEventListener("submit", event => {
    event.preventDefault();
    const input = byId("search-number"), text = input.value.trim(), agent = Number(text);
    const isThere = text !== "" && Number.isInteger(agent) && agent >= 0 && agent < replay.agents;
    input.setCustomValidity(isThere ? "" : `Expected a number of 0 to ${replay.agents - 1}`);
    input.reportValidity();
    if (!isThere) return;
    actions.select(agent);
    actions.show(agent);
    input.blur();
  });
  byId("search-number").addEventListener("input", event => event.target.setCustomValidity(""));
  function toggle(id) {
    for (const sheet of ["about", "help"]) {
      const hidden = sheet === id ? !byId(sheet).hidden : true;
      byId(sheet).hidden = hidden;
      byId(`${sheet}-button`).setAttribute("aria-expanded", !hidden);
    }
  }
  function step(count) {
    if (live && count > 0 && state.isAtEdge && (live.paused || Math.ceil(state.time) + count > last())) { live.ask({ steps: count }); return; }
    state.playing = false;
    actions.seek((live && state.isAtEdge ? last() : Math.floor(state.time)) + count);
  }
  function switchUser() { if (replay.probed) state.isWithout = !state.isWithout; }
  function step_agent(count) {
    actions.select((state.agent + count + replay.agents) % replay.agents);
    actions.show(state.agent);
  }
  function zoom(factor) { world.zoomBy(factor, world.canvas.clientWidth / 2, world.canvas.clientHeight / 2); dirty(); }
  function fit() { state.follow = false; world.fit(); dirty(); }
  function jump(direction) {
    const at = Math.floor(state.time), events = replay.events.filter(event => timeline.shows(event));
    const found = direction > 0 ? events.find(event => event.frame > at) : events.findLast(event => event.frame < at);
    if (found) actions.goTo(found);
  }

  // Keys.
  const keys = {
    " ": () => actions.play(!state.playing), ArrowLeft: event => step(event.shiftKey ? -10 : -1), ArrowRight: event => step(event.shiftKey ? 10 : 1),
    Home: () => actions.seek(0), End: () => actions.seek(last()),
    "[": () => actions.speed(SPEEDS[Math.max(0, SPEEDS.indexOf(state.speed) - 1)]), "]": () => actions.speed(SPEEDS[Math.min(SPEEDS.length - 1, SPEEDS.indexOf(state.speed) + 1)]),
    n: () => jump(1), p: () => jump(-1), ",": () => step_agent(-1), ".": () => step_agent(1), f: () => actions.follow(!state.follow),
    g: () => { state.goals = !state.goals; }, l: () => { state.numbers = !state.numbers; },
    c: () => {
      const names = ["", ...header.cameras.map(camera => camera.name)];
      actions.camera(names[(names.indexOf(state.camera) + 1) % names.length]);
    },
    o: () => switchUser(),
    "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: fit,
    "/": () => byId("search-number").focus(), "?": () => toggle("help"), Escape: () => { toggle(""); if (live && live.mine >= 0) actions.drive(false); },
  };
  if (live) keys.t = () => actions.drive(live.mine !== state.agent);
  window.addEventListener("keydown", event => {
    const isTyping = event.target.matches("input[inputmode], select");
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (isTyping) { if (event.key === "Escape") event.target.blur(); return; }
    if (live && live.key(event.key.length === 1 ? event.key.toLowerCase() : event.key, true)) { event.preventDefault(); return; }
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || (event.key === " " && event.target.matches("button, summary, input"))) return;
    event.preventDefault();
    act(event);
    dirty();
  });

  // Running world.
  const LIVE_TEXTS = { lost: "connection lost, reconnecting", refused: REFUSED, failed: "this page cannot read the received data", ended: "the simulation has ended" };
  function showLive() {
    byId("live-state").textContent = LIVE_TEXTS[live.state] ?? (live.paused ? "paused" : "live");
    byId("live-state").className = live.state === "live" && !live.paused ? "on" : "";
    byId("live").setAttribute("aria-pressed", state.isAtEdge);
    const isMine = live.mine === state.agent, isElse = live.driven === state.agent && !isMine;
    byId("drive").setAttribute("aria-pressed", isMine);
    byId("drive").textContent = isMine ? "Give back" : isElse ? "Driven elsewhere" : "Drive";
  }
  if (live) {
    for (const id of ["live-state", "live", "drive"]) byId(id).hidden = false;
    for (const element of document.querySelectorAll(".live-only")) element.hidden = false;
    on("live", () => actions.seek(last()));
    on("drive", () => { actions.drive(live.mine !== state.agent); byId("drive").blur(); });
    window.addEventListener("keyup", event => live.key(event.key.length === 1 ? event.key.toLowerCase() : event.key, false));
    window.addEventListener("blur", () => live.release());
    live.on = {
      fault(error) { live.close(); live.state = "failed"; dirty(); throw error; },
      restart() { state.time = last(); counted = -1; dirty(); },
      frame(dropped) {
        state.time = Math.max(0, state.time - dropped);
        counted = -1;
        fillMetrics();
        dirty();
      },
      change: dirty,
    };
  }

  // Pointers: drag, pinch, wheel, click.
  const canvas = world.canvas, pointers = new Map();
  let moved = 0;
  const place = event => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
    moved = 0;
  });
  canvas.addEventListener("pointermove", event => {
    const now = place(event), was = pointers.get(event.pointerId);
    if (!was) { hover(now); return; }
    if (pointers.size === 2) {
      const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)[1];
      world.zoomBy(Math.hypot(now[0] - other[0], now[1] - other[1]) / Math.max(1, Math.hypot(was[0] - other[0], was[1] - other[1])), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    }
    moved += Math.hypot(now[0] - was[0], now[1] - was[1]);
    if (moved > 4) {
      state.follow = false;
      canvas.classList.add("dragging");
      state.x -= (now[0] - was[0]) / state.zoom / pointers.size;
      state.y += (now[1] - was[1]) / state.zoom / pointers.size;
    }
    pointers.set(event.pointerId, now);
    dirty();
  });
  const release = event => {
    pointers.delete(event.pointerId);
    canvas.classList.remove("dragging");
    if (event.type === "pointerup" && moved <= 4) {
      const agent = world.agentAt(...place(event));
      if (agent !== null) actions.select(agent);
    }
    dirty();
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => { byId("tip").hidden = true; });
  canvas.addEventListener("dblclick", event => {
    const agent = world.agentAt(...place(event));
    if (agent !== null) { actions.select(agent); actions.follow(true); }
  });
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    world.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)), ...place(event));
    dirty();
  }, { passive: false });
  function hover([px, py]) {
    const agent = world.agentAt(px, py), tip = byId("tip"), at = Math.floor(state.time);
    tip.hidden = agent === null;
    canvas.style.cursor = agent === null ? "" : "pointer";
    if (agent === null) return;
    const isHalted = replay.raw("status", agent, at) === HALTED, reasons = reasonsOf(replay.raw("halt_reason", agent, at)).map(reason => reason.name).join(", ");
    tip.textContent = `agent ${agent}, ${CLASSES[replay.body(agent, at).agentClass]}, ` + (isHalted ? `halted: ${reasons}` : `${(3.6 * replay.get("speed_mps", agent, at)).toFixed(0)} km/h`) +
      `, at (${["x_m", "y_m"].map((name, axis) => (replay.get(name, agent, at) + origin[axis]).toFixed(2)).join(", ")})`;
    tip.style.left = `${Math.min(px + 14, canvas.clientWidth - tip.offsetWidth - 4)}px`;
    tip.style.top = `${Math.max(4, py - 30)}px`;
  }
  new ResizeObserver(dirty).observe(byId("stage"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { theme = readTheme(); world.map.forget(); dirty(); });

  // Current state, for tests and for inspection.
  window.pictura = {
    replay, state, actions, live,
    drawn: () => { render(); return world.drawn.map(({ agent, x_m, y_m, heading_deg, px, py }) => ({ agent, x_m, y_m, heading_deg, px, py })); },
    pictured: () => panel.pictured ?? {},
    // Bytes [height, width, 3] of each camera, drawn here.
    drawnImages: (agent, frame, change = {}) => {
      const contexts = header.cameras.map(({ width_px, height_px }) => new OffscreenCanvas(width_px, height_px).getContext("2d", { willReadFrequently: true }));
      panel.drawImages(agent, frame, change, contexts);
      return contexts.flatMap(context => [...context.getImageData(0, 0, context.canvas.width, context.canvas.height).data].filter((_, i) => i % 4 < 3));
    },
  };
  readAddress();
  if (live) live.ask({ watch: state.agent });
  fillHeader();
  render();  // called here, where errors are still caught
  requestAnimationFrame(now => { before = now; frame(now); });
}

if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", main);
else main();
