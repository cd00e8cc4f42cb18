// The colours of a field: from a dark blue over green to yellow, evenly lighter all the way, so that it reads the same to
// people who see colours differently, and in grey.

const SHADES = 256;

/** An OKLCH colour as red, green and blue (0 to 255). */
function rgbOf(lightness, chroma, hue) {
  const [a, b] = [chroma * Math.cos(hue), chroma * Math.sin(hue)];
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  return linear.map((x) => Math.round(255 * encode(Math.min(1, Math.max(0, x)))));
}

const COLOURS = Array.from({ length: SHADES }, (_, k) => {
  const share = k / (SHADES - 1);
  const hue = (285 - 185 * share) * Math.PI / 180;
  return rgbOf(0.36 + 0.52 * share, 0.13 + 0.03 * share, hue);
});
const STYLES = COLOURS.map((rgb) => `rgb(${rgb.join(" ")})`);

/** All colours from left to right, as CSS has it. */
function gradient() {
  const stops = Array.from({ length: 17 }, (_, k) => STYLES[Math.round(k * (SHADES - 1) / 16)]);
  return `linear-gradient(to right, ${stops.join(", ")})`;
}

/** Shows what the colours mean in the element of a bar. */
function showBar(bar, field) {
  const [low, high] = field.range;
  const scale = scaleOf(Math.max(Math.abs(low), Math.abs(high)), field.unit);
  const shown = [low * scale.factor, high * scale.factor];
  const values = high > low ? ticks(shown[0], shown[1], 4) : [shown[0]];
  const texts = labels(values);
  const place = (value) => (high > low ? 100 * (value - shown[0]) / (shown[1] - shown[0]) : 50);
  bar.querySelector(".strip").style.background = gradient();
  bar.querySelector(".ticks").replaceChildren(...values.map((value, k) => {
    const tick = document.createElement("span");
    tick.textContent = texts[k];
    tick.style.left = `${place(value)}%`;
    return tick;
  }));
  bar.setAttribute("aria-label", `Colours from ${short(shown[0])} to ${short(shown[1])} ${scale.unit}`);
  bar.dataset.unit = scale.unit;
  return beyond(field, scale);
}

/** What lies beyond the colours, in words. */
function beyond(field, scale) {
  const [low, high] = field.range;
  const [least, most] = field.extremes;
  const parts = [];
  const far = (value) => `${short(value * scale.factor)} ${scale.unit}`.trim();
  if (least < low) parts.push(`down to ${far(least)}`);
  if (most > high) parts.push(`up to ${far(most)}`);
  return parts.length ? `A few points lie beyond these colours: ${parts.join(" and ")}.` : "";
}
