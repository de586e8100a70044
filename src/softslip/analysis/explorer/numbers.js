"use strict";
// What the page holds: arrays as bytes, and numbers as `softslip export` writes them.

const DATA = JSON.parse(document.getElementById("data").textContent);
const LABELS = JSON.parse(document.getElementById("labels").textContent || "{}");
const TYPES = { f8: Float64Array, u4: Uint32Array, u2: Uint16Array, u1: Uint8Array };
const RUNS = DATA.runs.map((_, run) => run);

function decoded(array) {
  const text = atob(array.bytes);
  const bytes = new Uint8Array(text.length);
  for (let place = 0; place < text.length; place += 1) bytes[place] = text.charCodeAt(place);
  return new TYPES[array.type](bytes.buffer);
}

function remembered(make) {
  const known = new Map();
  return (name) => {
    if (!known.has(name)) known.set(name, make(name));
    return known.get(name);
  };
}

// Values of all runs: numbers, flags or texts.
const column = remembered((name) => {
  const values = DATA.columns[name];
  return Array.isArray(values) ? values : decoded(values);
});
const states = remembered((name) => decoded(DATA.states[name]));
const axisPlaces = remembered((number) => decoded(DATA.axes[number].of));

// The points of one kind of curve, run after run, and where each run begins.
const curves = remembered((name) => {
  const found = DATA.curves[name];
  const counts = decoded(found.counts);
  const starts = [0];
  counts.forEach((count, run) => starts.push(starts[run] + count));
  const error = found[`${name}_error`];
  return {
    ...found,
    x: decoded(found.x),
    points: decoded(found.points),
    values: decoded(found.values),
    error: error && decoded(error),
    starts,
  };
});

function curve(name, run) {
  const all = curves(name);
  const [from, to] = [all.starts[run], all.starts[run + 1]];
  const x = [];
  for (let point = from; point < to; point += 1) x.push(all.x[all.points[point]]);
  return {
    x,
    y: Array.from(all.values.subarray(from, to)),
    error: all.error && Array.from(all.error.subarray(from, to)),
  };
}

// A float64 as Python writes it: the shortest decimal that reads back as the same.
function written(value) {
  if (typeof value === "boolean") return value ? "1" : "0";
  if (typeof value !== "number") return String(value ?? "");
  if (Number.isNaN(value)) return "";
  if (!Number.isFinite(value)) return value > 0 ? "inf" : "-inf";
  if (Object.is(value, -0)) return "-0.0";
  const [digits, power] = value.toExponential().split("e");
  const exponent = Number(power);
  if (value !== 0 && (exponent < -4 || exponent >= 16)) {
    return `${digits}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
  }
  return Number.isInteger(value) ? `${value}.0` : String(value);
}

function withError(value, error) {
  return Number.isFinite(error) ? `${written(value)} ± ${written(error)}` : written(value);
}

function axisValue(axis, place) {
  const value = axis.values[place];
  return axis.whole ? String(value) : written(value);
}

// A text that may stand in HTML.
function escaped(text) {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;");
}

// A symbol such as R_1 or γ̇_wall as HTML, which plotly understands as well.
function symbolOf(axis) {
  const name = axis.symbol || axis.name.replaceAll("_", " ");
  return name.replace(/_(\w+)/g, "<sub>$1</sub>");
}

function plain(text) {
  const unmarked = text.replace(/<sub>(.*?)<\/sub>/g, "_$1");
  return unmarked.replaceAll("&lt;", "<").replaceAll("&amp;", "&");
}

// The swept values of a run.
const label = remembered((run) =>
  DATA.axes
    .map((axis, number) => {
      const value = axisValue(axis, axisPlaces(number)[run]);
      return `${symbolOf(axis)} = ${escaped(value)}`;
    })
    .join(", ") || DATA.runs[run],
);
