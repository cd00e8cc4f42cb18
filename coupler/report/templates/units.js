// Numbers, units and ticks as people read them.

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
// Units that take a prefix; in others large and small numbers are told by a power of ten.
const PREFIXABLE = /^(s|m|Pa|N|J|N\/m|J\/m|m\/s)$/;

/** The factor and the unit in which numbers up to `largest` (in `unit`) are read most easily. */
function scaleOf(largest, unit) {
  const size = Math.abs(largest);
  if (!(size > 0) || !Number.isFinite(size)) return { factor: 1, unit };
  if (PREFIXABLE.test(unit)) {
    const [value, letter] = PREFIXES.find(([value]) => size >= value * 0.9999) ?? PREFIXES.at(-1);
    return { factor: 1 / value, unit: letter + unit };
  }
  if (size >= 1e-2 && size < 1e5) return { factor: 1, unit };
  const power = 3 * Math.floor(Math.log10(size) / 3);
  const exponent = String(power).replace("-", "⁻").replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]);
  return { factor: 10 ** -power, unit: `10${exponent} ${unit}`.trim() };
}

/** A name and a unit: `Speed (m/s)`. */
function titled(name, unit) {
  return unit ? `${name} (${unit})` : name;
}

/** Round numbers from `low` to `high`, about `count` of them. */
function ticks(low, high, count) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const rough = span / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.75);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
}

/** The largest of 1, 2 and 5 times a power of ten that is not above a number. */
function roundBelow(number) {
  const power = 10 ** Math.floor(Math.log10(number));
  return power * [5, 2, 1].find((factor) => factor * power <= number * 1.001);
}

/** Powers of ten from `low` to `high`, and 2 and 5 times them where there are few. */
function logTicks(low, high) {
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const factors = last - first > 3 ? [1] : [1, 2, 5];
  const all = [];
  for (let power = first; power <= last; power += 1) all.push(...factors.map((factor) => factor * 10 ** power));
  return all.filter((tick) => tick >= low * 0.999 && tick <= high * 1.001);
}

/** The labels of ticks, all with as many decimals as their distance needs. */
function labels(values) {
  const gap = values.length > 1 ? Math.min(...values.slice(1).map((value, k) => Math.abs(value - values[k]))) : Math.abs(values[0]);
  const largest = Math.max(...values.map(Math.abs));
  const decimals = gap > 0 ? Math.min(8, Math.max(0, -Math.floor(Math.log10(gap) + 1e-9))) : 0;
  if (largest >= 1e6) return values.map((value) => value.toExponential(1).replace("e+", "e"));
  return values.map((value) => (Math.abs(value) < gap * 1e-6 ? 0 : value).toFixed(decimals).replace("-", "−"));
}

/** A number with three digits. */
function short(value) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-3 || size >= 1e6) return value.toExponential(2).replace("e+", "e").replace("-", "−");
  return value.toFixed(Math.max(0, 2 - Math.floor(Math.log10(size)))).replace("-", "−");
}
