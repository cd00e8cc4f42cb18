// Unpacks what report/src/motion/pack.rs has packed. The order of the arrays is the same there.

/** The bytes of a text in base64, inflated by the browser. */
async function inflate(text) {
  const bytes = Uint8Array.fromBase64?.(text) ?? Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

/** Takes arrays out of bytes, one after the other. */
class Unpacker {
  constructor(buffer) {
    this.bytes = new Uint8Array(buffer);
    this.at = 0;
  }

  take(count) {
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }

  words(count) {
    return new Uint16Array(this.take(2 * count).slice().buffer);
  }

  reals(count) {
    return new Float32Array(this.take(4 * count).slice().buffer);
  }

  /** Numbers in 16 bits of `count` things, frame after frame: each is its difference from going on as before. */
  track(frames, count) {
    const all = new Uint16Array(frames * count);
    for (let frame = 0; frame < frames; frame += 1) {
      const [low, high] = [this.take(count), this.take(count)];
      const here = frame * count;
      for (let k = 0; k < count; k += 1) {
        const folded = low[k] | (high[k] << 8);
        const off = (folded >>> 1) ^ -(folded & 1);
        all[here + k] = off + expected(all, frame, count, k);
      }
    }
    return all;
  }

  /** Numbers in 8 bits, each its difference from the frame before. */
  shades(frames, count) {
    const all = new Uint8Array(frames * count);
    for (let frame = 0; frame < frames; frame += 1) {
      const off = this.take(count);
      const here = frame * count;
      for (let k = 0; k < count; k += 1) {
        const before = frame > 0 ? all[here + k - count] : k > 0 ? all[k - 1] : 0;
        all[here + k] = off[k] + before;
      }
    }
    return all;
  }
}

function expected(all, frame, count, k) {
  const here = frame * count + k;
  if (frame === 0) return k > 0 ? all[k - 1] : 0;
  if (frame === 1) return all[k];
  return 2 * all[here - count] - all[here - 2 * count];
}

/** The motion of a run: what the page says of it, with its numbers. */
async function unpack(motion, text) {
  const packed = new Unpacker(await inflate(text));
  const frames = motion.times.length;
  const points = motion.points && unpackPoints(packed, motion, frames);
  const bodies = motion.bodies && unpackBodies(packed, motion, frames);
  return { ...motion, frames, points, bodies };
}

function unpackPoints(packed, motion, frames) {
  const { count, x, y, side } = motion.points;
  return {
    count,
    side,
    gone: packed.words(count),
    sizes: packed.take(count),
    x: packed.track(frames, count),
    y: packed.track(frames, count),
    place: places(x, y),
    shades: shadesOf(packed, motion.fields.filter((field) => field.points), frames, count),
  };
}

function unpackBodies(packed, motion, frames) {
  const { vertices, x, y } = motion.bodies;
  const count = vertices.length;
  const outlines = packed.reals(2 * vertices.reduce((sum, n) => sum + n, 0));
  return {
    count,
    vertices,
    outlines,
    x: packed.track(frames, count),
    y: packed.track(frames, count),
    angle: packed.track(frames, count),
    place: places(x, y),
    shades: shadesOf(packed, motion.fields.filter((field) => field.bodies), frames, count),
  };
}

/** From numbers in 16 bits to m. */
function places(x, y) {
  const step = ([low, high]) => (high - low) / 65535;
  return { x: x[0], y: y[0], dx: step(x), dy: step(y) };
}

function shadesOf(packed, fields, frames, count) {
  return new Map(fields.map((field) => [field.name, packed.shades(frames, count)]));
}
