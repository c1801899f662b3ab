// Events over time, one row per kind; a click seeks to an event.

class Timeline {
  constructor(replay, state, canvas, tip, actions) {
    // Pictures painted under and over the cursor, until they change.
    Object.assign(this, { replay, state, canvas, tip, actions, kept: null, rows: new OffscreenCanvas(1, 1), events: new OffscreenCanvas(1, 1) });
    canvas.addEventListener("pointerdown", event => {
      canvas.setPointerCapture(event.pointerId);
      const found = this.eventAt(event);
      if (found) this.actions.goTo(found);
      else this.scrub(event);
      this.isScrubbing = !found;
    });
    canvas.addEventListener("pointermove", event => {
      if (event.buttons && this.isScrubbing) this.scrub(event);
      this.showTip(event);
    });
    canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
  }
  get margin() { return 78; }
  frameAt(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left - this.margin) / (box.width - this.margin - 8);
    return Math.min(this.replay.frames - 1, Math.max(0, share * (this.replay.frames - 1)));
  }
  xOf(frame, width) { return this.margin + frame / Math.max(1, this.replay.frames - 1) * (width - this.margin - 8); }
  rowOf(event) { return Math.floor((event.clientY - this.canvas.getBoundingClientRect().top) / 11.5); }
  scrub(event) { this.actions.seek(Math.round(this.frameAt(event))); }
  shows(event) { return !this.state.onlyAgent || event.agent === this.state.agent; }
  // Returns the event under the pointer, within 4 pixels.
  eventAt(pointer) {
    const box = this.canvas.getBoundingClientRect(), x = pointer.clientX - box.left, row = this.rowOf(pointer);
    let found = null, nearest = 4.5;
    for (const event of this.replay.events) {
      const apart = Math.abs(this.xOf(event.frame, box.width) - x);
      if (event.kind === row && apart < nearest && this.shows(event)) { nearest = apart; found = event; }
    }
    return found;
  }
  showTip(pointer) {
    const { tip, replay } = this, found = this.eventAt(pointer), box = this.canvas.getBoundingClientRect();
    const frame = found ? found.frame : Math.round(this.frameAt(pointer));
    tip.textContent = `${((replay.firstStep + frame) * replay.dt_s).toFixed(1)} s` + (found ? `: agent ${found.agent}, ${KINDS[found.kind].name}` : "");
    tip.hidden = false;
    tip.style.left = `${Math.min(box.width - tip.offsetWidth, Math.max(0, pointer.clientX - box.left - tip.offsetWidth / 2)) + 12}px`;
    tip.style.bottom = `${this.canvas.clientHeight + 14}px`;
  }

  draw(theme, ratio) {
    const { canvas, replay, state } = this, width = canvas.clientWidth, height = 74;
    const key = [width, ratio, state.onlyAgent && state.agent, state.agent, theme, replay.version];
    if (!this.kept || key.some((part, i) => part !== this.kept[i])) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
      const repaint = (picture, paint) => {
        picture.width = canvas.width;  // setting the size clears the canvas
        picture.height = canvas.height;
        const context = picture.getContext("2d");
        context.scale(ratio, ratio);
        paint(context);
      };
      repaint(this.rows, context => this.paintRows(context, width, theme));
      repaint(this.events, context => {
        for (const event of replay.events) if (this.shows(event)) this.paintEvent(context, event, width, theme);
        if (replay.probed) this.paintCase(context, width, theme);
      });
      this.kept = key;
    }
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(this.rows, 0, 0);
    context.scale(ratio, ratio);
    const x = this.xOf(state.time, width);
    context.fillStyle = theme["--accent"];
    context.globalAlpha = 0.13;
    context.fillRect(this.margin, 0, x - this.margin, 58);
    context.globalAlpha = 1;
    context.fillRect(x - 1, 0, 2, 60);
    context.beginPath();
    context.arc(x, 60, 4, 0, 2 * Math.PI);
    context.fill();
    // Draws events over the cursor; those of the current step are wider than the cursor.
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.events, 0, 0);
    context.scale(ratio, ratio);
    const at = Math.floor(state.time);
    for (const event of replay.events) if (event.frame === at && this.shows(event)) this.paintEvent(context, event, width, theme, 7);
  }
  paintEvent(context, event, width, theme, size) {
    const isChosen = event.agent === this.state.agent, wide = size ?? (isChosen ? 2.5 : 1.6);
    context.fillStyle = theme[KINDS[event.kind].color];
    context.globalAlpha = size || isChosen ? 1 : 0.75;
    context.fillRect(this.xOf(event.frame, width) - wide / 2, event.kind * 11.5 + 1, wide, 9.5);
    context.globalAlpha = 1;
  }
  // Marks the position of a probe's case.
  paintCase(context, width, theme) {
    const x = this.xOf(this.replay.probed.frame, width), isLeft = x < width - 40;
    context.fillStyle = theme["--case"];
    context.fillRect(x - 1, 0, 2, 57);
    context.font = `11px ${theme["--font"]}`;
    context.textBaseline = "middle";
    context.textAlign = isLeft ? "left" : "right";
    context.fillText("case", x + (isLeft ? 5 : -5), 29);
  }
  paintRows(context, width, theme) {
    const { replay } = this;
    context.font = `11px ${theme["--font"]}`;
    context.textBaseline = "middle";
    KINDS.forEach((kind, row) => {
      const y = row * 11.5;
      context.fillStyle = theme["--raised"];
      context.fillRect(this.margin, y + 1, width - this.margin - 8, 9.5);
      context.fillStyle = theme[kind.color];
      context.textAlign = "left";
      context.fillText(kind.name, 0, y + 6);
      const count = replay.events.reduce((sum, event) => sum + (event.kind === row && this.shows(event)), 0);
      context.textAlign = "right";
      context.fillStyle = count ? theme["--text"] : theme["--dim"];
      context.fillText(count, this.margin - 5, y + 6);
    });
    context.fillStyle = theme["--dim"];
    for (const episode of replay.episodes) if (episode.first > 0) context.fillRect(this.xOf(episode.first, width) - 0.5, 0, 1, 60);
    // Labels round seconds, about 90 pixels apart.
    const seconds = (replay.frames - 1) * replay.dt_s, wish = seconds / Math.max(1, (width - this.margin) / 90);
    const step = [0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800, 3600].find(s => s >= wish) || 7200;
    const begin_s = replay.firstStep * replay.dt_s;
    for (let t = Math.ceil(begin_s / step - 1e-6) * step; t <= begin_s + seconds + 1e-6; t += step) {
      const x = this.xOf((t - begin_s) / replay.dt_s, width);
      context.fillRect(x, 58, 1, 3);
      context.textAlign = x < width - 14 ? "center" : "right";
      context.fillText(begin_s + seconds >= 120 && step >= 30 ? `${Math.floor(t / 60)}:${String(Math.round(t % 60)).padStart(2, "0")}` : `${Number(t.toFixed(1))} s`, Math.min(x, width), 68);
    }
  }
}
