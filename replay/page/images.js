// Lossless images, by an adaptive arithmetic coder: the counterpart of replay/images.cpp, see docs/reference/replay.md.

const SHIFTS = [1, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5];

class BitReader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = this.code = 0;
    this.range = 0xffffffff;
    for (let i = 0; i < 5; ++i) this.code = (this.code * 256 + this.next()) >>> 0;  // the first byte is 0
  }
  next() {
    if (this.at >= this.bytes.length) throw new Error("a group of images is truncated");
    return this.bytes[this.at++];
  }
  // Decodes a bit with the probability `i` of {zero, seen}.
  bit(chances, i) {
    let zero = chances.zero[i], bit = 0;
    const bound = (this.range >>> 15) * zero, seen = chances.seen[i], shift = SHIFTS[seen];
    if (seen < 15) chances.seen[i] = seen + 1;
    if (this.code < bound) {
      this.range = bound;
      zero += (32768 - zero) >> shift;
    } else {
      bit = 1;
      this.code -= bound;
      this.range -= bound;
      zero -= zero >> shift;
    }
    chances.zero[i] = zero < 32 ? 32 : zero > 32736 ? 32736 : zero;
    while (this.range < 0x1000000) {
      this.range = (this.range << 8) >>> 0;
      this.code = ((this.code << 8) | this.next()) >>> 0;
    }
    return bit;
  }
  number(chances, tree, bits) {
    let node = 1;
    for (let i = 0; i < bits; ++i) node = (node << 1) | this.bit(chances, tree + node);
    return node - (1 << bits);
  }
}

function makeChances(count) { return { zero: new Uint16Array(count).fill(16384), seen: new Uint8Array(count) }; }

function adler32(bytes) {
  let a = 1, b = 0;
  for (let i = 0; i < bytes.length;) {
    for (const end = Math.min(i + 3800, bytes.length); i < end; ++i) b += a += bytes[i];
    a %= 65521;
    b %= 65521;
  }
  return b * 65536 + a;
}

// Returns a hue's colour for all brightnesses, the highest channel: packed as in the images below.
function shadesOf(hue) {
  const highest = Math.max(...hue), shades = new Int32Array(256);
  for (let brightness = 0; brightness < 256; ++brightness) {
    const [r, g, b] = hue.map(value => Math.floor((2 * value * brightness + highest) / (2 * highest)));
    shades[brightness] = (r << 16) | (g << 8) | b;
  }
  return shades;
}

// Returns the frames of a group: bytes [frames, cameras, height, width, 3].
function unpackImages(cameras, hues, group, count, frameBytes) {
  const NO_HUE = 30, FREE = 31, NEW = 4;
  const reader = new BitReader(group.subarray(0, group.length - 4)), shades = hues.map(shadesOf);
  const candidate = makeChances(4 * 8000), hueChances = makeChances(32 * 32 * 32), brightness = makeChances(32 * 8 * 256), rounding = makeChances(32 * 3 * 2), free = makeChances(3 * 16 * 256);
  // Per pixel: colour 0xRRGGBB, candidate, and hue.
  const images = cameras.map(({ width_px, height_px }) => {
    const size = width_px * height_px;
    return { color: new Int32Array(size), how: new Uint8Array(size), hue: new Uint8Array(size).fill(NO_HUE) };
  });
  const out = new Uint8Array(frameBytes * count);
  const near = (hue, channel, guess) => {
    const i = (hue * 3 + channel) * 2;
    return reader.bit(rounding, i) === 0 ? guess : reader.bit(rounding, i + 1) ? guess + 1 : guess - 1;
  };
  let to = 0;
  for (let frame = 0; frame < count; ++frame) {
    cameras.forEach(({ width_px: width, height_px: height }, c) => {
      const { color, how, hue } = images[c];
      for (let y = 0, i = 0; y < height; ++y) {
        for (let x = 0; x < width; ++x, ++i) {
          const w = x > 0 ? color[i - 1] : 0, n = y > 0 ? color[i - width] : 0, p = color[i];
          const ne = y > 0 && x + 1 < width ? color[i - width + 1] : 0, nw = x > 0 && y > 0 ? color[i - width - 1] : 0;
          const alike = (w === n) | ((w === p) << 1) | ((n === p) << 2) | ((n === ne) << 3) | ((nw === w) << 4) | ((nw === n) << 5);
          const context = ((alike * 5 + (x > 0 ? how[i - 1] : 0)) * 5 + (y > 0 ? how[i - width] : 0)) * 5 + how[i];
          const leftHue = x > 0 ? hue[i - 1] : NO_HUE, upHue = y > 0 ? hue[i - width] : NO_HUE;
          let value, way, shownHue;
          if (reader.bit(candidate, context)) { value = w; way = 0; shownHue = leftHue; }
          else if (n !== w && reader.bit(candidate, 8000 + context)) { value = n; way = 1; shownHue = upHue; }
          else if (p !== w && p !== n && reader.bit(candidate, 16000 + context)) { value = p; way = 2; shownHue = hue[i]; }
          else if (ne !== w && ne !== n && ne !== p && reader.bit(candidate, 24000 + context)) {
            value = ne;
            way = 3;
            shownHue = y > 0 && x + 1 < width ? hue[i - width + 1] : NO_HUE;
          } else {
            way = NEW;
            shownHue = reader.number(hueChances, (leftHue * 32 + upHue) * 32, 5);
            if (shownHue >= shades.length) {
              shownHue = FREE;
              const r = reader.number(free, 0, 8), g = reader.number(free, 4096 + (r >> 4) * 256, 8), b = reader.number(free, 8192 + (g >> 4) * 256, 8);
              value = (r << 16) | (g << 8) | b;
            } else {
              const level = Math.max(p >> 16, (p >> 8) & 255, p & 255) >> 5;
              const guess = shades[shownHue][reader.number(brightness, (shownHue * 8 + level) * 256, 8)];
              const r = near(shownHue, 0, guess >> 16), g = near(shownHue, 1, (guess >> 8) & 255), b = near(shownHue, 2, guess & 255);
              value = ((r & 255) << 16) | ((g & 255) << 8) | (b & 255);
            }
          }
          color[i] = value;
          how[i] = way;
          hue[i] = shownHue;
          out[to++] = value >> 16;
          out[to++] = value >> 8;
          out[to++] = value;
        }
      }
    });
  }
  const sum = group.subarray(group.length - 4).reduce((all, byte) => all * 256 + byte, 0);
  if (sum !== adler32(out)) throw new Error("a group of images is damaged");
  return out;
}

// Runs unpackImages() outside the page's thread, so that playback does not stall: a function of its arguments that
// returns a promise, or null if the browser allows no such worker.
function imageWorker() {
  const waiting = new Map();
  let worker, count = 0;
  try {
    const parts = [`const SHIFTS = ${JSON.stringify(SHIFTS)};`, BitReader, makeChances, adler32, shadesOf, unpackImages,
      `onmessage = ({ data: [id, work] }) => {
        try {
          const frames = unpackImages(...work);
          postMessage([id, frames], [frames.buffer]);
        } catch (error) {
          postMessage([id, null, error.message]);
        }
      };`];
    worker = new Worker(URL.createObjectURL(new Blob([parts.join("\n")], { type: "text/javascript" })));
  } catch {
    return null;
  }
  worker.onmessage = ({ data: [id, frames, fault] }) => {
    const { resolve, reject } = waiting.get(id);
    waiting.delete(id);
    if (frames) resolve(frames);
    else reject(new Error(fault));
  };
  return work => new Promise((resolve, reject) => {
    waiting.set(++count, { resolve, reject });
    worker.postMessage([count, work]);
  });
}
