// Draws motions and plays them. All runs share the clock, the field and its colours.

// Points are drawn so much larger than their volumes: rounding to pixels must not open seams between them.
const OVERLAP = 1.15;

/** A picture of one run. */
class Stage {
  constructor(canvas, motion) {
    this.canvas = canvas;
    this.motion = motion;
    this.context = canvas.getContext("2d", { alpha: false });
    this.order = new Uint32Array(motion.points?.count ?? 0);
    this.view = widened(motion.view);
    this.resting = motion.bodies && restingBodies(motion.bodies, motion.frames);
    this.round = motion.bodies && roundBodies(motion.bodies);
  }

  /** Fits the canvas to the room that it has on the page; whether that has changed anything. */
  fit() {
    const [left, bottom, right, top] = this.view;
    const width = this.canvas.parentElement.clientWidth;
    const height = Math.round(Math.min(width * (top - bottom) / (right - left), Math.max(220, 0.62 * window.innerHeight)));
    const density = Math.min(window.devicePixelRatio || 1, 2);
    const size = [Math.round(width * density), Math.round(height * density)];
    if (this.canvas.width === size[0] && this.canvas.height === size[1]) return false;
    [this.canvas.width, this.canvas.height] = size;
    this.canvas.style.height = `${height}px`;
    this.density = density;
    this.scale = Math.min(size[0] / (right - left), size[1] / (top - bottom));
    this.x0 = size[0] / 2 - this.scale * (left + right) / 2;
    this.y0 = size[1] / 2 + this.scale * (bottom + top) / 2;
    return true;
  }

  /** The number of the frame that is last at `time` (s). */
  frameAt(time) {
    const { times } = this.motion;
    const end = times.at(-1);
    const slack = 1e-9 * Math.abs(end);
    let frame = times.length - 1;
    while (frame > 0 && times[frame] > time + slack) frame -= 1;
    return frame;
  }

  draw(time, field) {
    const frame = this.frameAt(time);
    this.frame = frame;
    const paint = inks();
    const { context, canvas } = this;
    context.fillStyle = paint.ground;
    context.fillRect(0, 0, canvas.width, canvas.height);
    if (this.motion.domain) this.drawDomain(paint);
    if (this.motion.points) this.drawPoints(frame, this.lookup(field, "points"), paint);
    if (this.motion.bodies) this.drawBodies(frame, this.lookup(field, "bodies"), paint);
    this.drawRuler(paint);
  }

  /** The shade of a colour for each shade of this run's own; none where it has not the field. */
  lookup(field, kind) {
    const own = this.motion.fields.find((other) => other.name === field?.name);
    const shades = own?.[kind] && this.motion[kind].shades.get(own.name);
    if (!shades) return null;
    const [low, high] = field.range;
    const span = own.range[1] - own.range[0];
    const shade = (k) => {
      const value = own.range[0] + span * k / 255;
      const share = high > low ? (value - low) / (high - low) : 0;
      return Math.round(Math.min(1, Math.max(0, share)) * (SHADES - 1));
    };
    return { shades, to: Uint8Array.from({ length: 256 }, (_, k) => shade(k)) };
  }

  drawDomain(paint) {
    const [left, bottom, right, top] = this.motion.domain;
    const { context, scale, x0, y0, density } = this;
    context.strokeStyle = paint.faint;
    context.lineWidth = density;
    context.setLineDash([4 * density, 4 * density]);
    context.strokeRect(x0 + scale * left, y0 - scale * top, scale * (right - left), scale * (top - bottom));
    context.setLineDash([]);
  }

  /** Squares of the points' volumes, colour by colour. Their edges lie between pixels, so that neighbours leave no seam. */
  drawPoints(frame, colours, paint) {
    const { points } = this.motion;
    const { context, scale, x0, y0 } = this;
    const here = frame * points.count;
    const begins = this.sort(frame, colours);
    const [dx, dy] = [scale * points.place.dx, scale * points.place.dy];
    const [ox, oy] = [x0 + scale * points.place.x, y0 - scale * points.place.y];
    const half = scale * points.side * OVERLAP / 510;
    for (let shade = 0; shade < SHADES; shade += 1) {
      if (begins[shade] === begins[shade + 1]) continue;
      context.fillStyle = colours ? STYLES[shade] : paint.point;
      for (let n = begins[shade]; n < begins[shade + 1]; n += 1) {
        const k = this.order[n];
        const [x, y] = [ox + dx * points.x[here + k], oy - dy * points.y[here + k]];
        const reach = Math.max(0.5, half * points.sizes[k]);
        const [left, top] = [Math.round(x - reach), Math.round(y - reach)];
        context.fillRect(left, top, Math.round(x + reach) - left || 1, Math.round(y + reach) - top || 1);
      }
    }
  }

  /** Puts the points that are there in the order of their shades; where each shade begins in it. */
  sort(frame, colours) {
    const { count, gone } = this.motion.points;
    const here = frame * count;
    const shade = (k) => (colours ? colours.to[colours.shades[here + k]] : 0);
    const begins = new Uint32Array(SHADES + 1);
    for (let k = 0; k < count; k += 1) if (frame < gone[k]) begins[shade(k) + 1] += 1;
    for (let n = 0; n < SHADES; n += 1) begins[n + 1] += begins[n];
    const next = begins.slice();
    for (let k = 0; k < count; k += 1) if (frame < gone[k]) this.order[next[shade(k)]++] = k;
    return begins;
  }

  drawBodies(frame, colours, paint) {
    const { bodies } = this.motion;
    const { context, density } = this;
    context.lineWidth = Math.max(1, density);
    context.lineJoin = "round";
    let vertex = 0;
    for (let k = 0; k < bodies.count; k += 1) {
      const at = frame * bodies.count + k;
      const count = bodies.vertices[k];
      const path = this.outline(k, at, vertex, count);
      context.fillStyle = colours && !this.resting[k] ? STYLES[colours.to[colours.shades[at]]] : paint.body;
      context.strokeStyle = paint.edge;
      context.fill(path);
      context.stroke(path);
      vertex += count;
    }
  }

  /** The outline of a body in a frame; of a round one with the radius that shows how it has turned. */
  outline(k, at, vertex, count) {
    const { bodies } = this.motion;
    const { scale, x0, y0 } = this;
    const angle = bodies.angle[at] * 2 * Math.PI / 65536;
    const [cos, sin] = [scale * Math.cos(angle), scale * Math.sin(angle)];
    const x = x0 + scale * (bodies.place.x + bodies.place.dx * bodies.x[at]);
    const y = y0 - scale * (bodies.place.y + bodies.place.dy * bodies.y[at]);
    const path = new Path2D();
    for (let n = vertex; n < vertex + count; n += 1) {
      const [u, v] = [bodies.outlines[2 * n], bodies.outlines[2 * n + 1]];
      path.lineTo(x + cos * u - sin * v, y - sin * u - cos * v);
    }
    path.closePath();
    if (this.round[k]) path.lineTo(x, y);
    return path;
  }

  /** A length to compare with. */
  drawRuler(paint) {
    const { context, canvas, density, scale } = this;
    const metres = roundBelow(0.25 * canvas.width / scale);
    const length = metres * scale;
    const { factor, unit } = scaleOf(metres, "m");
    const [x, y] = [12 * density, canvas.height - 12 * density];
    context.fillStyle = paint.ink;
    context.fillRect(x, y, length, 2 * density);
    context.font = `${12 * density}px ${paint.font}`;
    const text = `${short(metres * factor).replace(/\.0+$/, "")} ${unit}`;
    context.lineWidth = 3 * density;
    context.strokeStyle = paint.ground;
    context.strokeText(text, x, y - 5 * density);
    context.fillText(text, x, y - 5 * density);
  }
}

/** Which bodies never move: walls and floors, whose colour would say nothing. */
function restingBodies({ count, x, y, angle }, frames) {
  const still = (track, k) => {
    for (let frame = 1; frame < frames; frame += 1) if (track[frame * count + k] !== track[k]) return false;
    return true;
  };
  return Array.from({ length: count }, (_, k) => frames > 1 && [x, y, angle].every((track) => still(track, k)));
}

/** Which bodies are discs, of which only a radius shows that they turn. */
function roundBodies({ vertices, outlines }) {
  let vertex = 0;
  return vertices.map((count) => {
    const radii = Array.from({ length: count }, (_, n) => Math.hypot(outlines[2 * (vertex + n)], outlines[2 * (vertex + n) + 1]));
    vertex += count;
    return count > 16 && Math.max(...radii) < 1.001 * Math.min(...radii);
  });
}

/** What is shown of the plane, neither too flat nor too tall for a page. */
function widened([left, bottom, right, top]) {
  const [width, height] = [right - left, top - bottom];
  const [more, taller] = [Math.max(0, height * 0.6 - width) / 2, Math.max(0, width * 0.28 - height) / 2];
  return [left - more, bottom - taller, right + more, top + taller];
}

/** The colours of the page's style, as a canvas takes them. */
function inks() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(name).trim();
  return {
    ground: of("--stage"), ink: of("--ink"), faint: of("--rule-strong"), body: of("--body"),
    edge: of("--body-edge"), point: of("--accent"), font: "system-ui, sans-serif",
  };
}

/** The clock of all stages, and its controls. */
class Player {
  constructor(stages, elements) {
    this.stages = stages;
    this.elements = elements;
    this.times = stages.map((stage) => stage.motion.times).reduce((a, b) => (b.at(-1) > a.at(-1) || (b.at(-1) === a.at(-1) && b.length > a.length) ? b : a));
    this.fields = commonFields(stages.map((stage) => stage.motion));
    this.place = 0;
    this.listeners = [];
    this.ended = new AbortController();
    this.prepare();
    this.showField();
    this.show(0);
  }

  prepare() {
    const { play, scrub, rate, field, root } = this.elements;
    scrub.max = this.times.length - 1;
    field.replaceChildren(...this.fields.map((one) => new Option(titled(one.label, one.unit), one.name)));
    play.addEventListener("click", () => this.toggle());
    scrub.addEventListener("input", () => { this.pause(); this.show(Number(scrub.value)); });
    field.addEventListener("change", () => this.showField());
    rate.addEventListener("change", () => { this.begun = null; });
    root.addEventListener("keydown", (event) => this.key(event));
    const { signal } = this.ended;
    document.addEventListener("keydown", (event) => { if (event.target === document.body) this.key(event); }, { signal });
    this.resized = new ResizeObserver(() => this.redraw());
    this.resized.observe(root);
  }

  /** The keys of the player, but for those that the control in focus has a use for. */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const tag = event.target.tagName;
    if (tag === "SELECT" || (tag === "BUTTON" && event.key === " ")) return;
    const last = this.times.length - 1;
    const moves = { ArrowLeft: this.place - 1, ArrowRight: this.place + 1, Home: 0, End: last };
    if (event.key === " ") {
      this.toggle();
    } else if (event.key in moves) {
      this.pause();
      this.show(Math.min(last, Math.max(0, moves[event.key])));
    } else {
      return;
    }
    event.preventDefault();
  }

  /** Hears nothing any more; another player takes the place of this one. */
  end() {
    this.pause();
    this.ended.abort();
    this.resized.disconnect();
  }

  get time() {
    return this.times[this.place];
  }

  get field() {
    return this.fields.find((field) => field.name === this.elements.field.value);
  }

  /** Shows the frame of this number. */
  show(place) {
    this.place = place;
    const { scrub, clock } = this.elements;
    const scale = scaleOf(this.times.at(-1), "s");
    const digits = Math.max(0, 3 - Math.floor(Math.log10(this.times.at(-1) * scale.factor || 1)));
    const text = (time) => (time * scale.factor).toFixed(Math.min(digits, 4));
    scrub.value = place;
    clock.textContent = `${text(this.time)} of ${text(this.times.at(-1))} ${scale.unit}`;
    scrub.setAttribute("aria-valuetext", clock.textContent);
    this.draw();
    for (const listener of this.listeners) listener(this.time);
  }

  /** Shows the frame nearest to `time` (s). */
  seek(time) {
    const away = this.times.map((other) => Math.abs(other - time));
    this.pause();
    this.show(away.indexOf(Math.min(...away)));
  }

  showField() {
    const { bar, hint } = this.elements;
    bar.hidden = !this.field;
    hint.textContent = this.field ? showBar(bar, this.field) : "";
    this.draw();
  }

  draw() {
    for (const stage of this.stages) {
      stage.fit();
      stage.draw(this.time, this.field);
    }
  }

  redraw() {
    const changed = this.stages.map((stage) => stage.fit());
    if (changed.some(Boolean)) this.draw();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.place === this.times.length - 1) this.show(0);
    this.begun = null;
    this.playing = requestAnimationFrame((now) => this.tick(now));
    this.showState();
  }

  pause() {
    if (!this.playing) return;
    cancelAnimationFrame(this.playing);
    this.playing = null;
    this.showState();
  }

  /** One picture of a motion that plays: the whole of it takes four to ten seconds at normal speed. */
  tick(now) {
    const last = this.times.length - 1;
    this.begun ??= { now, place: this.place };
    const length = Math.min(10, Math.max(4, last / 25));
    const frames = (now - this.begun.now) / 1000 * last / length * Number(this.elements.rate.value);
    const place = Math.min(last, Math.floor(this.begun.place + frames));
    if (place !== this.place) this.show(place);
    if (place === last) {
      this.pause();
    } else {
      this.playing = requestAnimationFrame((next) => this.tick(next));
    }
  }

  showState() {
    const { play } = this.elements;
    play.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    play.firstElementChild.textContent = this.playing ? "❚❚" : "▶";
  }
}

/** The fields of all runs, each with the range of all. */
function commonFields(motions) {
  const fields = new Map();
  for (const field of motions.flatMap((motion) => motion.fields)) {
    const known = fields.get(field.name);
    fields.set(field.name, known ? joined(known, field) : field);
  }
  return [...fields.values()];
}

function joined(a, b) {
  const wider = (one, other) => [Math.min(one[0], other[0]), Math.max(one[1], other[1])];
  return { ...a, range: wider(a.range, b.range), extremes: wider(a.extremes, b.extremes) };
}
