"use strict";
// The chosen run: its profile, creep, snapshot and numbers, and where it comes from.

const SVG = "http://www.w3.org/2000/svg";
const ENDS = /_(error|freedom|drift|drift_error|smoothing)$/;
const VERDICTS = {
  shear_rate_wall: "verdict_wall",
  shear_rate_bulk: "verdict_bulk",
  slip_velocity: "verdict_slip",
};

function pointTexts(along, name, { x, y, error }) {
  return y.map((value, point) => {
    const number = withError(value, error ? error[point] : NaN);
    return `${along} = ${written(x[point])}<br>${name} = ${number}`;
  });
}

function drawRunProfile(run) {
  const found = curve("normalised_velocity", run);
  const ends = found.y.map((value, point) => [value, found.error[point] || 0]);
  const band = {
    x: [...found.x, ...found.x.toReversed()],
    y: [...ends.map(([v, e]) => v + e), ...ends.map(([v, e]) => v - e).toReversed()],
    fill: "toself",
    fillcolor: "rgba(11, 92, 148, 0.2)",
    line: { width: 0 },
    mode: "lines",
    hoverinfo: "skip",
  };
  const line = {
    ...found,
    mode: "lines",
    line: { color: "#0b5c94", width: 1.6 },
    text: pointTexts("y / H", "v<sub>norm</sub>", found),
    hovertemplate: "%{text}<extra></extra>",
  };
  const straight = { x: [0, 1], y: [0, 1], mode: "lines", hoverinfo: "skip" };
  straight.line = { color: "#888", width: 1, dash: "dot" };
  const axes = [axisLayout("y / H", false), axisLayout("v<sub>norm</sub>", false)];
  Plotly.react(byId("run-profile"), [straight, band, line], layout(...axes), CONFIG);
  byId("run-profile-note").textContent = thinnedNote("normalised_velocity");
}

function drawRunCreep(run) {
  const looks = { shear_rate_wall: ["#0072B2", "solid"], shear_rate_bulk: ["#D55E00", "5px,2px"] };
  const traces = Object.entries(RATE_NAMES).map(([name, symbol]) => {
    const found = curve(name, run);
    const [color, dash] = looks[name];
    return {
      x: found.x,
      y: found.y.map((value) => (value > 0 ? value : null)),
      name: symbol,
      mode: "lines",
      line: { color, dash, width: 1.6 },
      text: pointTexts("t", symbol, found),
      hovertemplate: "%{text}<extra></extra>",
    };
  });
  const [time, rate] = [curves("shear_rate_wall").along_quantity, curves("shear_rate_wall").quantity];
  const axes = [axisLayout(`t [${time[0]}]`, true), axisLayout(`γ̇ [${rate[0]}]`, true)];
  const legend = { x: 1, xanchor: "right", y: 1, bgcolor: "rgba(255, 255, 255, 0.8)" };
  Plotly.react(byId("run-creep"), traces, layout(...axes, { showlegend: true, legend }), CONFIG);
  byId("run-creep-note").textContent = thinnedNote("shear_rate_wall");
}

function svg(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  made.append(...children);
  return made;
}

// Particles with their periodic images, and the walls, in a frame whose y points downwards.
function snapshotPicture(found, words) {
  const { length, height, grid, origin } = found;
  const corners = Array.from(decoded(found.corners), (value) => value / grid - origin);
  const depth = 0.03 * height;
  let start = 0;
  const shapes = Array.from(decoded(found.sizes), (size) => {
    const shape = corners.slice(2 * start, 2 * (start + size));
    start += size;
    return Array.from({ length: size }, (_, corner) => [shape[2 * corner], shape[2 * corner + 1]]);
  });
  const place = ([x, y], shift) => `${(x + shift).toPrecision(6)} ${(height - y).toPrecision(6)}`;
  const path = (shape, shift) => shape.map((corner) => place(corner, shift)).join("L");
  const walls = shapes.splice(-2).map((wall, number) => {
    const outside = number ? height + 2 * depth : -2 * depth;
    const contour = [-1, 0, 1].map((period) => path(wall, period * length)).join("L");
    const ends = [2 * length, -length].map((x) => place([x, outside], 0)).join("L");
    return `M${contour}L${ends}Z`;
  });
  const particles = shapes.flatMap((shape) => {
    const images = Math.max(...shape.map(([x]) => x)) > length ? [0, -length] : [0];
    return images.map((shift) => `M${path(shape, shift)}Z`);
  });
  const outline = { "vector-effect": "non-scaling-stroke", "stroke-width": 0.7 };
  const filled = { fill: "#8FBBDD", stroke: "#1F5A8C", ...outline };
  const whole = height + 2 * depth;
  const size = `aspect-ratio: ${length} / ${whole}; max-width: ${(24 * length) / whole}rem`;
  return svg(
    "svg",
    { viewBox: `0 ${-depth} ${length} ${whole}`, role: "img", "aria-label": words, style: size },
    svg("path", { d: particles.join(""), class: "particles", ...filled }),
    svg("path", { d: walls.join(""), fill: "black" }),
  );
}

function drawSnapshot(run) {
  const name = DATA.runs[run];
  const found = DATA.snapshots[name];
  const folder = byId("run-snapshot");
  folder.replaceChildren();
  if (found) {
    const words = `Particles and walls at t = ${written(found.time)}`;
    folder.append(snapshotPicture(found, words), element("p", { className: "note", textContent: words }));
  } else if (DATA.without_room.includes(name)) {
    folder.append(
      "There is no room in this page for its snapshot. To draw it: ",
      element("code", { textContent: `softslip draw snapshot shear/${name}.nc --output ${name}.png` }),
    );
  } else {
    folder.append("This run keeps no snapshots: its recording.snapshots is empty.");
  }
}

function row(...cells) {
  const [first, ...rest] = cells;
  const heading = element("th", { scope: "row", textContent: first });
  return element("tr", {}, heading, ...rest.map((textContent) => element("td", { textContent })));
}

function table(id, headings, rows) {
  const cells = headings.map((textContent) => element("th", { scope: "col", textContent }));
  byId(id).replaceChildren(
    element("thead", {}, element("tr", {}, ...cells)),
    element("tbody", {}, ...rows),
  );
}

function drawNumbers(run) {
  const names = Object.keys(DATA.columns);
  const value = (name) => (name in DATA.columns ? written(column(name)[run]) : "");
  const single = names.filter((name) => !ENDS.test(name) && !/^(steady|verdict|yielded)/.test(name));
  const rows = single
    .filter((name) => value(name))
    .map((name) => {
      const [unit, meaning] = DATA.quantities[name];
      const error = value(`${name}_error`);
      return row(meaning, value(name) + (error && `\n± ${error}`), unit === "1" ? "" : unit);
    });
  table("run-numbers", ["", "value ± standard error", "unit"], rows);
  const every = names.map((name) => row(name, value(name), DATA.quantities[name][0]));
  table("run-columns", ["column", "value", "unit"], every);
}

function drawStates(run) {
  const items = Object.entries(VERDICTS).map(([name, verdict]) => {
    const words = column(verdict)[run] || "no such series";
    const picture = icon(states(name)[run], "#333", "circle");
    const meaning = `<span>${DATA.quantities[name][1]}: <b>${words}</b></span>`;
    return element("li", { html: `${picture} ${meaning}` });
  });
  byId("run-states").replaceChildren(...items);
}

function originLines(name) {
  const parents = LABELS.parents ?? [];
  const place = parents.findIndex((each) => each.stage === "shear" && each.run === name);
  const origin = LABELS.provenance?.runs?.[name] || {};
  const changed = origin.dirty ? " (with changes that were not committed)" : "";
  return [
    ["run", `shear ${name}`],
    ["file", `shear/${name}.nc`],
    ["content_sha256", parents[place]?.content_sha256],
    ["record_sha256", LABELS.provenance?.parent_records?.[place]],
    ["commit of the code", origin.commit && `${origin.commit}${changed}`],
    ["fingerprint of the code", origin.fingerprint],
    ["software", origin.environment],
    ["machine", [origin.host, origin.processor].filter(Boolean).join(", ")],
    ["seed", origin.seed],
    ["began", origin.started],
    ["ended", origin.ended],
    ["processor time [s]", origin.core_seconds],
    ["interruptions", origin.restarts],
    ["more of it", `softslip trace shear/${name}.nc`],
  ].filter(([, value]) => value !== undefined && value !== null && value !== "");
}

function drawOrigin(name) {
  const lines = originLines(name).flatMap(([key, value]) => [
    element("dt", { textContent: key }),
    element("dd", { className: "digest", textContent: value }),
  ]);
  byId("run-origin").replaceChildren(...lines);
}

function choose(run, isClick = false) {
  if (run === undefined || run === null) return;
  chosen.run = run;
  history.replaceState(null, "", `#run=${DATA.runs[run]}`);
  showRun(run);
  moveMarks();
  const details = byId("details");
  if (isClick && details.getBoundingClientRect().top > 0.6 * innerHeight) {
    details.scrollIntoView({ behavior: "smooth" });
  }
}

function showRun(run) {
  byId("run").value = String(run);
  byId("run-title").innerHTML = label(run);
  byId("run-body").hidden = false;
  drawStates(run);
  drawRunProfile(run);
  drawRunCreep(run);
  drawSnapshot(run);
  drawNumbers(run);
  drawOrigin(DATA.runs[run]);
}

function listRuns() {
  const select = byId("run");
  const options = shownRuns().map((run) =>
    element("option", { value: run, textContent: plain(label(run)) }),
  );
  select.replaceChildren(...options);
  select.value = chosen.run === null ? "" : String(chosen.run);
}

function step(by) {
  const runs = shownRuns();
  const place = runs.indexOf(chosen.run);
  if (runs.length) choose(runs.at(place < 0 ? 0 : (place + by) % runs.length));
}

function refresh() {
  drawLegend();
  listRuns();
  drawPanels();
}

function tellSummary() {
  const shared = DATA.shared.map((each) => `${symbolOf(each)} = ${written(each.value)}`);
  const missing = DATA.missing.map((values) =>
    Object.entries(values).map(([name, value]) => escaped(`${name} = ${value}`)).join(", "),
  );
  const some = missing.slice(0, 3).join("; ") + (missing.length > 3 ? "; …" : "");
  const words = [
    `${RUNS.length} runs`,
    missing.length ? `${missing.length} more are missing (${some})` : "",
    shared.length ? `all at ${shared.join(", ")}` : "",
  ];
  byId("summary").innerHTML = words.filter(Boolean).join(", ");
  const text = JSON.stringify(LABELS.parameters ?? {}, null, 1);
  byId("footer").append(
    element("details", {}, element("summary", { textContent: "Parameters of the scenario" }), element("pre", { textContent: text })),
    element("p", {
      textContent:
        `Page content_sha256 ${LABELS.content_sha256}. Numbers are those of softslip export, ` +
        `to the last digit. ${document.querySelector("meta[name=generator]").content}.`,
    }),
  );
}

function start() {
  tellSummary();
  buildFilters();
  buildPanels();
  byId("run").addEventListener("change", (event) => choose(Number(event.target.value)));
  byId("before").addEventListener("click", () => step(-1));
  byId("after").addEventListener("click", () => step(1));
  const asked = DATA.runs.indexOf(location.hash.replace("#run=", ""));
  const pictured = DATA.runs.findIndex((name) => name in DATA.snapshots);
  chosen.run = Math.max(asked >= 0 ? asked : pictured, 0);
  refresh();
  showRun(chosen.run);
  performance.mark("drawn");
}

start();
