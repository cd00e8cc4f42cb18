// Curves as SVG, drawn anew when their room changes. Colours and type are those of the page's style.

const SVG = "http://www.w3.org/2000/svg";
const CURSORS = new Set();

function element(name, attributes = {}, text = "") {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

/**
 * Draws a chart into an element and keeps it fitted.
 *
 * spec: { title, unit, time, series: [{label, values, colour}], kind: "stack" | "line" | "steps", expected, height, log, range }
 */
function chart(host, spec, seek) {
  const legend = document.createElement("ul");
  legend.className = "legend";
  const heading = document.createElement("p");
  heading.className = "axis-title";
  const svg = element("svg", { role: "img" });
  host.replaceChildren(heading, svg, legend);
  const plot = new Plot(svg, heading, legend, spec);
  new ResizeObserver(() => plot.draw(host.clientWidth)).observe(host);
  plot.draw(host.clientWidth);
  CURSORS.add((time) => plot.point(time));
  svg.addEventListener("pointermove", (event) => showCursors(plot.timeOf(event)));
  svg.addEventListener("pointerdown", (event) => seek?.(plot.timeOf(event)));
}

/** Shows the same moment in all charts. */
function showCursors(time) {
  for (const show of CURSORS) show(time);
}

class Plot {
  constructor(svg, heading, legend, spec) {
    Object.assign(this, { svg, heading, legend, spec });
    this.scaleX = scaleOf(spec.time.at(-1), "s");
    this.bands = spec.kind === "line" ? null : stacked(spec);
    [this.low, this.high] = spec.range ?? this.extent();
    this.scaleY = scaleOf(Math.max(Math.abs(this.low), Math.abs(this.high)), spec.unit);
    heading.textContent = titled(spec.title, this.scaleY.unit);
    this.prepareLegend();
    svg.setAttribute("aria-label", this.inWords());
  }

  inWords() {
    const { series, title } = this.spec;
    const y = (value) => short(value * this.scaleY.factor);
    const names = series.length > 1 ? `: ${series.map((one) => one.label).join(", ")}` : "";
    return `${title} over time${names}; from ${y(this.low)} to ${y(this.high)} ${this.scaleY.unit}`;
  }

  /** The least and the largest number that is drawn. */
  extent() {
    const { spec } = this;
    const values = this.bands
      ? this.bands.flatMap((band) => [...band.upper, ...band.lower])
      : spec.series.flatMap((one) => one.values);
    const all = values.concat(spec.expected ?? []).filter((value) => value !== null && Number.isFinite(value));
    if (!all.length) return [0, 1];
    let [low, high] = [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))];
    if (spec.log) return [low, high];
    if (this.bands) [low, high] = [Math.min(0, low), Math.max(0, high)];
    else if (low > 0 && low < 0.5 * high) low = 0;
    if (low === high) return low === 0 ? [-1, 1] : [low - Math.abs(low) / 2, high + Math.abs(high) / 2];
    const room = 0.04 * (high - low);
    return [low === 0 ? 0 : low - room, high === 0 ? 0 : high + room];
  }

  prepareLegend() {
    const { spec, legend } = this;
    const rows = spec.series.map((one) => [one.label, `c${one.colour}`]);
    if (spec.expected) rows.push([spec.expectedLabel, "dashed"]);
    legend.hidden = rows.length < 2 && !spec.alwaysLegend;
    this.values = rows.map(([label, colour]) => {
      const row = document.createElement("li");
      const [swatch, name, value] = ["i", "span", "b"].map((tag) => document.createElement(tag));
      swatch.className = `swatch ${colour}`;
      name.textContent = label;
      row.append(swatch, name, value);
      legend.append(row);
      return value;
    });
  }

  draw(width) {
    if (width < 40 || width === this.width) return;
    this.width = width;
    const height = this.spec.height ?? (width < 500 ? 210 : 270);
    const { svg, scaleX, scaleY, spec } = this;
    const [low, high] = [this.low * scaleY.factor, this.high * scaleY.factor];
    const valuesY = spec.log ? logTicks(low, high) : ticks(low, high, Math.max(3, Math.round(height / 50)));
    const textsY = spec.log ? valuesY.map(short).map((text) => text.replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "")) : labels(valuesY);
    const left = 12 + 7.2 * Math.max(...textsY.map((text) => text.length));
    this.box = { left, right: width - 14, top: 8, bottom: height - 40 };
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("width", width);
    svg.setAttribute("height", height);
    svg.replaceChildren();
    this.drawGrid(valuesY, textsY);
    this.drawTimes(ticks(spec.time[0] * scaleX.factor, spec.time.at(-1) * scaleX.factor, Math.max(2, Math.round(width / 110))), height);
    if (this.bands) this.drawBands();
    else this.drawLines();
    if (spec.expected) svg.append(element("path", { d: this.path(spec.expected), class: "expected" }));
    this.cursor = element("line", { class: "cursor", y1: this.box.top, y2: this.box.bottom, visibility: "hidden" });
    svg.append(this.cursor);
    if (this.pointed !== undefined) this.point(this.pointed);
  }

  x(time) {
    const { left, right } = this.box;
    const [first, last] = [this.spec.time[0], this.spec.time.at(-1)];
    return left + (right - left) * (last > first ? (time - first) / (last - first) : 0.5);
  }

  y(value) {
    const { top, bottom } = this.box;
    const of = this.spec.log ? Math.log : (number) => number;
    const [low, high] = [of(this.low), of(this.high)];
    return bottom - (bottom - top) * (high > low ? (of(value) - low) / (high - low) : 0.5);
  }

  drawGrid(values, texts) {
    const { left, right } = this.box;
    values.forEach((value, k) => {
      const y = this.y(value / this.scaleY.factor);
      this.svg.append(element("line", { x1: left, x2: right, y1: y, y2: y, class: value === 0 ? "axis" : "grid" }));
      this.svg.append(element("text", { x: left - 8, y: y + 4, "text-anchor": "end" }, texts[k]));
    });
  }

  drawTimes(values, height) {
    const { right, bottom } = this.box;
    const texts = labels(values);
    values.forEach((value, k) => {
      const x = this.x(value / this.scaleX.factor);
      this.svg.append(element("line", { x1: x, x2: x, y1: bottom, y2: bottom + 5, class: "axis" }));
      const near = x > right - 12 ? "end" : "middle";
      this.svg.append(element("text", { x: near === "end" ? right : x, y: bottom + 18, "text-anchor": near }, texts[k]));
    });
    this.svg.append(element("text", { x: right, y: height - 4, "text-anchor": "end", class: "title" }, titled("Time", this.scaleX.unit)));
  }

  drawBands() {
    for (const { upper, lower, colour } of this.bands) {
      const back = this.corners(lower).reverse();
      const d = `M${[...this.corners(upper), ...back].join("L")}Z`;
      this.svg.append(element("path", { d, class: `band c${colour}` }));
    }
  }

  drawLines() {
    for (const { values, colour } of this.spec.series) {
      this.svg.append(element("path", { d: this.path(values), class: `curve c${colour}` }));
    }
  }

  /** The corners of a line through these numbers; of numbers between times, with steps. */
  corners(values) {
    const { time } = this.spec;
    const corner = (t, value) => `${this.x(t).toFixed(1)},${this.y(value).toFixed(1)}`;
    if (values.length === time.length) return values.map((value, k) => corner(time[k], value));
    return values.flatMap((value, k) => [corner(time[k], value), corner(time[k + 1], value)]);
  }

  /** A line that is broken where there is no number. */
  path(values) {
    if (values.every((value) => value !== null)) return `M${this.corners(values).join("L")}`;
    const { time } = this.spec;
    const parts = values.map((value, k) => {
      if (value === null) return "";
      const pen = k > 0 && values[k - 1] !== null ? "L" : "M";
      return `${pen}${this.x(time[k]).toFixed(1)},${this.y(value).toFixed(1)}`;
    });
    return parts.join("") || "M0,0";
  }

  timeOf(event) {
    const { left, right } = this.box;
    const bounds = this.svg.getBoundingClientRect();
    const share = (event.clientX - bounds.left - left) / (right - left);
    const [first, last] = [this.spec.time[0], this.spec.time.at(-1)];
    return first + Math.min(1, Math.max(0, share)) * (last - first);
  }

  /** Marks a moment, and tells the numbers at it. */
  point(time) {
    this.pointed = time;
    const { spec } = this;
    const within = time >= spec.time[0] && time <= spec.time.at(-1) * (1 + 1e-6);
    this.cursor.setAttribute("visibility", within ? "visible" : "hidden");
    const x = this.x(Math.min(time, spec.time.at(-1))).toFixed(1);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
    const all = spec.series.map((one) => one.values).concat(spec.expected ? [spec.expected] : []);
    this.values.forEach((element, k) => {
      const value = within ? valueAt(spec.time, all[k], time) : null;
      element.textContent = value === null ? "" : `${short(value * this.scaleY.factor)} ${this.scaleY.unit}`;
    });
  }
}

/** The last number at a time, or that of the interval around it. */
function valueAt(times, values, time) {
  let k = times.findIndex((other) => other > time * (1 + 1e-6)) - 1;
  if (k < 0) k = time < times[0] ? 0 : times.length - 1;
  return values[Math.min(k, values.length - 1)];
}

/** Each series on top of those before it; numbers below zero hang below it. */
function stacked(spec) {
  const count = spec.series[0]?.values.length ?? 0;
  const [above, below] = [new Array(count).fill(0), new Array(count).fill(0)];
  return spec.series.map(({ values, colour }) => {
    const [lower, upper] = [[], []];
    values.forEach((value, k) => {
      const side = value < 0 ? below : above;
      lower.push(side[k]);
      side[k] += value ?? 0;
      upper.push(side[k]);
    });
    return { lower, upper, colour };
  });
}
