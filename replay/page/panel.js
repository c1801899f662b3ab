// Panel of one agent: its actions, images, rewards, and conditioning.

const LONG_JERKS = ["-15", "-4", "0", "+4"], LAT_JERKS = ["-4", "0", "+4"];  // m/s3, in the order of the action space

const decimals = (value, digits) => (Object.is(value, -0) ? 0 : value).toFixed(digits).replace("-", "\u2212");
// Formats numbers of very different sizes: three significant digits, up to the seventh decimal, the recorded precision.
function short(value) {
  if (Math.abs(value) < 5e-8) return "0";
  const first = Math.floor(Math.log10(Math.abs(value)));
  return decimals(value, Math.min(7, Math.max(2, 2 - first))).replace(/(\.\d\d\d*?)0+$/, "$1");
}

class Panel {
  constructor(replay, state, actions) {
    Object.assign(this, { replay, state, actions, shown: null, drawer: null, noDrawer: "" });
    this.facts = this.makeFacts();
    this.cells = this.makeActions();
    this.rows = this.makeRewards();
    this.curves = this.makeCurves();
    this.pictures = this.makePictures();
    this.makeCase();
  }

  makeFacts() {
    const facts = {};
    for (const [key, name] of [["speed", "Speed"], ["steer", "Steering"], ["acceleration", "Acceleration"], ["value", "Value"], ["reward", "Reward"], ["return", "Return"]]) {
      const box = make("div"), value = make("dd");
      box.append(make("dt", name), value);
      byId("facts").append(box);
      facts[key] = { box, value };
    }
    return facts;
  }
  makeActions() {
    const grid = byId("actions"), cells = [];
    grid.append(make("span", "m/s\u00b3"));
    for (const name of ["left", "straight", "right"]) grid.append(make("span", name));
    for (let long = 3; long >= 0; --long) {
      grid.append(make("span", LONG_JERKS[long].replace("-", "\u2212")));
      for (let lat = 2; lat >= 0; --lat) {
        const cell = cells[3 * long + lat] = make("div", "\u00a0");
        cell.title = `jerk ${LONG_JERKS[long]} m/s\u00b3 along, ${LAT_JERKS[lat]} m/s\u00b3 to the left`;
        grid.append(cell);
      }
    }
    return cells;
  }
  makeRewards() {
    return [...this.replay.rewardTerms, "total"].map(term => {
      const row = make("tr", undefined, term === "total" ? "total" : ""), bar = make("b"), track = make("i"), holder = make("td"), now = make("td"), sum = make("td");
      track.append(bar);
      holder.append(track);
      row.append(make("td", term.replace("_", " ")), holder, now, sum);
      byId("rewards").append(row);
      return { term, row, bar, now, sum };
    });
  }
  makeCurves() {
    const list = [
      { name: "speed, m/s", color: "--vehicle", of: (a, f) => this.replay.get("speed_mps", a, f), digits: 1 },
      { name: "steering, degrees", color: "--cyclist", of: (a, f) => this.replay.get("steer_deg", a, f), digits: 1 },
      { name: "return of the episode", color: "--goal", of: (a, f) => this.returns[f], digits: 2 },
      { name: "value", color: "--wall-contact", of: (a, f) => this.replay.decision(a, f)?.value ?? NaN, digits: 2, decided: true },
    ];
    for (const curve of list) {
      curve.box = make("div");
      curve.canvas = make("canvas");
      curve.output = make("output");
      curve.box.append(curve.canvas, make("span", curve.name), curve.output);
      byId("curves").append(curve.box);
      curve.canvas.addEventListener("pointerdown", event => {
        const box = curve.canvas.getBoundingClientRect();
        this.actions.seek(Math.round((event.clientX - box.left) / box.width * (this.replay.frames - 1)));
      });
    }
    return list;
  }
  makePictures() {
    return this.replay.header.cameras.map(camera => {
      const figure = make("figure"), canvas = make("canvas");
      canvas.width = camera.width_px;
      canvas.height = camera.height_px;
      canvas.style.aspectRatio = `${camera.width_px} / ${camera.height_px}`;
      figure.append(canvas, make("figcaption", camera.name.replace(/_/g, " ")));
      figure.addEventListener("click", () => this.actions.camera(this.state.camera === camera.name ? "" : camera.name));
      document.querySelector(".pictures").append(figure);
      const context = canvas.getContext("2d");
      return { figure, canvas, camera, context, pixels: context.createImageData(camera.width_px, camera.height_px) };
    });
  }

  // Shows the description of the probe's case, and each policy's response.
  makeCase() {
    const { probed } = this.replay;
    if (!probed) return;
    byId("case").hidden = false;
    byId("case-what").textContent = probed.what;
    byId("case-step").textContent = `Step ${probed.frame}`;
    byId("case-step").addEventListener("click", () => this.actions.showCase());
    const row = (tag, texts) => { const line = make("tr"); line.append(...texts.map(text => make(tag, text))); return line; };
    if (probed.answers.length === 0) return;
    byId("case-answers").append(row("th", ["policy", "V", "\u0394V", "P(brake)", "\u0394P(brake)"]), ...probed.answers.map(answer => {
      const change = value => (value >= 5e-8 ? "+" : "") + short(value);
      return row("td", [answer.policy, short(answer.value), change(answer.value - answer.value_without), short(answer.brake), change(answer.brake - answer.brake_without)]);
    }));
  }

  // Returns sums of one agent's rewards since the episode began.
  sumRewards(agent) {
    const { replay } = this, frames = replay.frames;
    this.returns = new Float64Array(frames);
    this.sums = replay.rewardTerms.map(() => new Float64Array(frames));
    replay.rewardTerms.forEach((term, t) => {
      const unit = replay.units[`reward_${term}`];
      for (let frame = 0; frame < frames; ++frame) {
        const begins = replay.episode(frame).first === frame;
        this.sums[t][frame] = (begins ? 0 : this.sums[t][frame - 1]) + replay.raw(`reward_${term}`, agent, frame) * unit;
        this.returns[frame] += this.sums[t][frame];
      }
    });
  }

  draw(theme, ratio) {
    const { replay, state } = this, frame = Math.floor(state.time), agent = state.agent;
    const isNew = !this.shown || this.shown.agent !== agent || this.shown.theme !== theme || this.shown.version !== replay.version;
    if (isNew || this.shown.width !== this.curves[0].canvas.clientWidth) {
      this.sumRewards(agent);
      this.drawCurves(theme, ratio);
    }
    this.drawPlayheads(frame, theme, ratio);
    if (isNew || this.shown.frame !== frame || this.shown.camera !== state.camera || this.shown.isWithout !== state.isWithout) {
      this.drawHead(frame, agent, theme);
      this.drawActions(frame, agent, theme);
      this.drawRewards(frame, agent, theme);
      this.drawPictures(frame);
      if (isNew || this.shown.episode !== replay.episodeOf[frame]) this.drawConditioning(frame, agent);
    }
    this.shown = { agent, frame, theme, version: replay.version, camera: state.camera, isWithout: state.isWithout, width: this.curves[0].canvas.clientWidth, episode: replay.episodeOf[frame] };
  }

  drawHead(frame, agent, theme) {
    const { replay } = this, body = replay.body(agent, frame), status = STATUS[replay.raw("status", agent, frame)];
    byId("agent-name").textContent = `Agent ${agent}`;
    byId("agent-class").style.color = theme[CLASS_COLORS[body.agentClass]];
    const line = byId("agent-status"), size = `${CLASSES[body.agentClass]}, ${body.length_m.toFixed(1)} x ${body.width_m.toFixed(1)} m`;
    if (status === "halted") {
      const reasons = reasonsOf(replay.raw("halt_reason", agent, frame));
      let since = frame;
      while (since > replay.episode(frame).first && replay.raw("status", agent, since - 1) === HALTED) --since;
      line.replaceChildren(`${size}, halted since ${((replay.firstStep + since) * replay.dt_s).toFixed(1)} s: `, ...reasons.map((reason, i) => {
        const word = make("b", (i ? ", " : "") + reason.name);
        word.style.color = theme[reason.color];
        return word;
      }));
    } else line.textContent = status === "absent" ? `${status}: the agent found no place in this episode, or is not in the recording now` : status === "recorded" ? `${size}, as recorded` : `${size}, ${status}, waypoint ${replay.raw("next_waypoint", agent, frame) + 1} of 3`;
    const decision = replay.decision(agent, frame), before = Math.max(replay.episode(frame).first, frame - 1);
    const set = (key, value, digits, unit) => {
      this.facts[key].value.replaceChildren(Number.isFinite(value) ? decimals(value, digits) : "\u2013", make("small", ` ${unit}`));
    };
    set("speed", replay.get("speed_mps", agent, frame) * 3.6, 1, "km/h");
    set("steer", replay.get("steer_deg", agent, frame), 1, "\u00b0");
    // A halted agent is stopped within a step, which is not braking. An absent agent has no speed.
    set("acceleration", status === "halted" || status === "absent" ? NaN : frame > before && !replay.isAbsent(agent, before) ? (replay.get("speed_mps", agent, frame) - replay.get("speed_mps", agent, before)) / replay.dt_s : 0, 1, "m/s\u00b2");
    set("value", decision ? decision.value : NaN, 2, "");
    // An agent that follows a recording has no actions and no rewards of its own.
    const isRecorded = status === "recorded";
    for (const part of [this.facts.reward.box, this.facts.return.box, byId("action-section"), byId("reward-section")]) part.hidden = isRecorded;
    this.facts.value.box.hidden = !replay.isFollowed(agent, frame) || !replay.decisions;
    const reward = replay.rewardTerms.reduce((sum, term) => sum + replay.get(`reward_${term}`, agent, frame), 0);
    this.facts.reward.value.textContent = short(reward);
    set("return", this.returns[frame], 2, "");
  }

  drawActions(frame, agent) {
    const { replay } = this, decision = replay.decision(agent, frame), chosen = replay.action(agent, frame);
    byId("action-note").textContent = decision ? "probability of each action; frame: the chosen action"
      : !replay.decisions || replay.followedAt(frame) < 0 ? "frame: the chosen action"
      : replay.isFollowed(agent, frame) ? "its policy does not act now" : `the policy's probabilities are those of agent ${replay.followedAt(frame)}`;
    this.cells.forEach((cell, i) => {
      const p = decision ? decision.probabilities[i] : 0;
      cell.classList.toggle("chosen", i === chosen);
      cell.style.background = p ? `color-mix(in srgb, var(--accent) ${Math.round(70 * Math.sqrt(p))}%, var(--raised))` : "";
      cell.textContent = decision ? (p < 0.0005 ? "0" : `${(100 * p).toFixed(p < 0.1 ? 1 : 0)} %`) : i === chosen ? "chosen" : "\u00a0";
    });
  }

  drawRewards(frame, agent, theme) {
    const { replay } = this;
    let total = 0;
    this.rows.forEach(({ term, row, bar, now, sum }, t) => {
      const value = term === "total" ? total : replay.get(`reward_${term}`, agent, frame);
      const whole = term === "total" ? this.returns[frame] : this.sums[t][frame];
      total += value;
      now.textContent = short(value);
      sum.textContent = short(whole);
      row.classList.toggle("zero", value === 0 && whole === 0);
      // Terms differ by factors of a million, so the bar's length shows the logarithm.
      const share = value ? Math.min(1, Math.max(0.04, 1 + Math.log10(Math.abs(value)) / 6)) / 2 : 0;
      bar.style.cssText = `left:${value < 0 ? 50 - 100 * share : 50}%;width:${100 * share}%;background:${theme[value < 0 ? "--negative" : "--positive"]}`;
    });
  }

  drawConditioning(frame, agent) {
    const names = this.replay.header.conditioning, values = this.replay.episode(frame).conditioning;
    byId("conditioning").replaceChildren(...names.flatMap((name, i) => [make("dt", name), make("dd", Number(values[agent * names.length + i].toPrecision(4)))]));
  }

  // Draws the cameras' images into contexts. Throws if the browser cannot draw them.
  drawImages(agent, frame, change, contexts) {
    if (this.noDrawer) throw new Error(this.noDrawer);
    try {
      this.drawer ??= new CameraView(this.replay);
      this.drawer.draw(agent, frame, change, contexts);
    } catch (error) {
      this.noDrawer = error.message;
      throw error;
    }
  }

  async drawPictures(frame) {
    const { replay, state } = this, { agent } = state, shows = this.pictures.length > 0 && !replay.isAbsent(agent, frame);
    byId("cameras").hidden = !shows;
    if (!shows) return;
    for (const { figure, camera } of this.pictures) figure.classList.toggle("large", camera.name === state.camera);
    // In the step of a case its road user can be removed, or added if the scene lacks it.
    const user = replay.caseUser(agent, frame), change = user && state.isWithout !== user.isInserted ? user.change : null;
    byId("user-shown").hidden = !user;
    byId("user-shown").textContent = `${state.isWithout ? "without" : "with"} the road user`;
    byId("user-shown").setAttribute("aria-pressed", !state.isWithout);
    const isKept = !change && replay.hasImages(agent, frame), wanted = this.wanted = {};
    let bytes = null, fault = "";
    if (isKept) {
      try {
        bytes = await replay.imagesOf(frame);
      } catch (error) {
        this.actions.fail(`its images cannot be read (${error.message})`);
        return;
      }
    } else {
      try {
        this.drawImages(agent, frame, change ?? {}, this.pictures.map(({ context }) => context));
      } catch (error) {
        fault = error.message;
      }
    }
    if (wanted !== this.wanted || (isKept && !bytes)) return;
    byId("pictures-note").textContent = fault ? `not recorded, and not drawn: ${fault}` : isKept ? replay.imageSource : "drawn by this page, not recorded";
    document.querySelector(".pictures").hidden = Boolean(fault);
    if (fault) return;
    let at = 0;
    for (const { context, pixels } of isKept ? this.pictures : []) {
      for (let to = 0; to < pixels.data.length; to += 4, at += 3) {
        pixels.data[to] = bytes[at];
        pixels.data[to + 1] = bytes[at + 1];
        pixels.data[to + 2] = bytes[at + 2];
        pixels.data[to + 3] = 255;
      }
      context.putImageData(pixels, 0, 0);
    }
    this.pictured = { frame, agent, isKept };
  }

  drawCurves(theme, ratio) {
    const { replay, state } = this;
    for (const curve of this.curves) {
      const values = Float32Array.from({ length: replay.frames }, (_, frame) => replay.isAbsent(state.agent, frame) ? NaN : curve.of(state.agent, frame));
      curve.box.hidden = Boolean(curve.decided) && values.every(Number.isNaN);
      const width = Math.max(1, Math.round(curve.canvas.clientWidth * ratio)), height = Math.round(52 * ratio);
      if (curve.box.hidden) continue;
      let low = 0, high = 0;
      for (const value of values) { if (value < low) low = value; if (value > high) high = value; }
      if (high - low < 1e-6) high = low + 1;
      const picture = curve.picture = curve.picture || document.createElement("canvas");
      picture.width = width;
      picture.height = height;
      const context = picture.getContext("2d"), top = 18 * ratio, bottom = height - 4 * ratio;
      const y = value => bottom - (value - low) / (high - low) * (bottom - top);
      context.strokeStyle = theme["--line"];
      context.beginPath();
      context.moveTo(0, y(0));
      context.lineTo(width, y(0));
      context.stroke();
      context.strokeStyle = theme[curve.color];
      context.lineWidth = 1.3 * ratio;
      context.lineJoin = "round";
      context.beginPath();
      // Draws the minimum and maximum of frames that share a pixel.
      const step = Math.max(1, Math.floor(replay.frames / width / 2));
      let isOn = false;
      for (let frame = 0; frame < replay.frames; frame += step) {
        let least = Infinity, most = -Infinity;
        for (let i = frame; i < Math.min(frame + step, replay.frames); ++i) { if (values[i] < least) least = values[i]; if (values[i] > most) most = values[i]; }
        if (most < least || (replay.episode(frame).first > frame - step && frame > 0)) isOn = false;
        if (most < least) continue;
        const x = frame / Math.max(1, replay.frames - 1) * width;
        if (isOn) context.lineTo(x, y(least)); else context.moveTo(x, y(least));
        if (most > least) context.lineTo(x, y(most));
        isOn = true;
      }
      context.stroke();
      Object.assign(curve, { y, values, width, height });
    }
  }
  drawPlayheads(frame, theme, ratio) {
    for (const curve of this.curves) {
      if (curve.box.hidden || !curve.picture) continue;
      const { canvas, picture, width, height, values } = curve;
      if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
      const context = canvas.getContext("2d");
      context.clearRect(0, 0, width, height);
      context.drawImage(picture, 0, 0);
      const x = this.state.time / Math.max(1, this.replay.frames - 1) * width;
      context.fillStyle = theme["--text"];
      context.fillRect(Math.round(x), 0, ratio, height);
      const value = values[frame];
      curve.output.textContent = Number.isFinite(value) ? decimals(value, curve.digits) : "";
      if (!Number.isFinite(value)) continue;
      context.beginPath();
      context.arc(x, curve.y(value), 2.6 * ratio, 0, 2 * Math.PI);
      context.fill();
    }
  }
}
