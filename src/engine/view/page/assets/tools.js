// Reading what the page carries, and small helpers.
"use strict";

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);

function make(name, properties, ...children) {
  const element = document.createElement(name);
  Object.assign(element, properties);
  element.append(...children);
  return element;
}

const whole = new Intl.NumberFormat("en-US");
const count = (n) => whole.format(n);

function number(x, digits = 4) {
  if (x === null || x === undefined) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  if (size >= 1e6 || size < 1e-3) return x.toExponential(digits - 1);
  return x.toLocaleString("en-US", { maximumSignificantDigits: digits });
}

const percent = (share, digits = 2) => (100 * share).toFixed(digits) + " %";

function bytes(n) {
  if (n === null || n === undefined) return "–";
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  let unit = 0;
  for (; n >= 1024 && unit < 4; unit++) n /= 1024;
  return (unit < 2 ? n.toFixed(0) : n.toFixed(1)) + " " + units[unit];
}

function seconds(s) {
  if (s >= 7200) return (s / 3600).toFixed(1) + " h";
  if (s >= 120) return (s / 60).toFixed(1) + " min";
  return s.toFixed(s < 10 ? 2 : 1) + " s";
}

// Hues a golden section apart: the same colors as in `tetdb snapshot`.
function kind(n) {
  const hue = ((n * 0.618033988749895 + 0.58) % 1) * 6;
  const [light, gray] = Math.floor(n / 7) % 2 === 0 ? [225, 0.42] : [175, 0.35];
  return [5, 3, 1].map((shift) => {
    const k = (shift + hue) % 6;
    const dip = Math.min(Math.max(Math.min(k, 4 - k), 0), 1);
    return Math.round(light * (1 - (1 - gray) * dip));
  });
}

const STOPS = [[52, 28, 92], [52, 84, 142], [34, 136, 140], [70, 182, 106], [172, 218, 58], [252, 236, 120]];
function scale(share) {
  const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
  const i = Math.min(Math.floor(at), STOPS.length - 2);
  return [0, 1, 2].map((k) => Math.round(STOPS[i][k] + (at - i) * (STOPS[i + 1][k] - STOPS[i][k])));
}
const css = (rgb) => `rgb(${rgb.join(" ")})`;

// A surface of this page.
function unpack(id) {
  const text = atob(byId(id).textContent.trim());
  return unpackBytes((at) => text.charCodeAt(at));
}

// A surface as it was packed: numbers of seven bits a byte, low first.
function unpackBytes(byteAt) {
  let at = 0;
  const next = () => {
    let value = 0, shift = 1, byte;
    do {
      byte = byteAt(at++);
      value += (byte & 127) * shift;
      shift *= 128;
    } while (byte > 127);
    return value;
  };
  const difference = () => {
    const n = next();
    return n % 2 ? -(n + 1) / 2 : n / 2;
  };
  const [nPoints, nTriangles, nChannels] = [next(), next(), next()];
  const points = new Uint16Array(3 * nPoints);
  for (let i = 0; i < points.length; i++) points[i] = (i < 3 ? 0 : points[i - 3]) + difference();
  const corners = new Uint32Array(3 * nTriangles);
  for (let i = 0, seen = 0; i < corners.length; i++) {
    const back = next();
    corners[i] = seen - back;
    if (back === 0) seen++;
  }
  const channels = [];
  for (let c = 0; c < nChannels; c++) {
    const values = new Uint32Array(nTriangles);
    for (let i = 0; i < nTriangles; ) {
      const end = i + next();
      values.fill(next(), i, end);
      i = end;
    }
    channels.push(values);
  }
  return { nTriangles, points, corners, channels };
}
