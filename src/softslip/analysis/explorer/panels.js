"use strict";
// The panels over all runs: flow curve, slip velocity, creep and velocity profiles.

const RATE_NAMES = { shear_rate_wall: "γ̇<sub>wall</sub>", shear_rate_bulk: "γ̇<sub>bulk</sub>" };
const RATE_WORDS = { shear_rate_wall: "apparent, at the walls", shear_rate_bulk: "true, in the bulk" };
const COARSE = matchMedia("(pointer: coarse)").matches;
const CONFIG = {
  responsive: true,
  displaylogo: false,
  modeBarButtons: [["toImage", "zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]],
};

function axisLayout(title, logarithmic) {
  return {
    title: { text: title, standoff: 6 },
    type: logarithmic ? "log" : "linear",
    exponentformat: "power",
    ...(logarithmic ? { minor: { ticks: "inside", ticklen: 3 } } : {}),
    showline: true,
    mirror: true,
    ticks: "inside",
    linecolor: "#444",
    gridcolor: "#e8ebef",
    zeroline: false,
    // Labels of a logarithmic axis are short; to measure them takes a quarter of the time.
    automargin: !logarithmic,
  };
}

function layout(x, y, more = {}) {
  return {
    xaxis: x,
    yaxis: y,
    margin: { l: 66, r: 12, t: 30, b: 46 },
    showlegend: false,
    hovermode: "closest",
    dragmode: COARSE ? false : "zoom",
    font: { family: "system-ui, sans-serif", size: 12, color: "#1c2430" },
    hoverlabel: { bgcolor: "white", bordercolor: "#444", font: { color: "#1c2430" }, align: "left" },
    paper_bgcolor: "white",
    plot_bgcolor: "white",
    ...more,
  };
}

// Points of runs, by family and verdict; what is no place on a logarithmic axis is counted.
function pointTraces(x, y, along) {
  const traces = [];
  let hidden = 0;
  families().forEach(({ colour, symbol, runs }) => {
    STATES.forEach((_, state) => {
      const group = { x: [], y: [], minus: [], plus: [], runs: [], text: [] };
      runs.forEach((run) => {
        if (states(along.name)[run] !== state) return;
        const [left, up] = [x.values[run], y.values[run]];
        if (!Number.isFinite(left) || !Number.isFinite(up)) return;
        if (chosen.logarithmic && (left <= 0 || up <= 0)) {
          hidden += 1;
          return;
        }
        const error = along.error[run];
        const [minus, plus] = bars(along.axis === "x" ? left : up, error, chosen.logarithmic);
        group.x.push(left);
        group.y.push(up);
        group.minus.push(minus);
        group.plus.push(plus);
        group.runs.push(run);
        const [first, second] = along.axis === "x" ? [y, x] : [x, y];
        group.text.push(
          `${label(run)}<br>${first.symbol} = ${written(first.values[run])}` +
            `<br>${second.symbol} = ${withError(second.values[run], error)}` +
            `<br>${STATES[state]}`,
        );
      });
      if (group.runs.length) traces.push(...stateTraces(group, state, colour, symbol, along.axis));
    });
  });
  return { traces, hidden };
}

function stateTraces(group, state, colour, symbol, axis) {
  const bar = { type: "data", symmetric: false, array: group.plus, arrayminus: group.minus };
  const solid = { ...bar, color: colour, thickness: 1, width: 2 };
  const points = {
    type: "scatter",
    mode: "markers",
    x: group.x,
    y: group.y,
    customdata: group.runs,
    text: group.text,
    hovertemplate: "%{text}<extra></extra>",
    marker: marker(state, colour, symbol),
    ...(state === DRIFTING ? {} : { [`error_${axis}`]: solid }),
  };
  if (state !== DRIFTING) return [points];
  const dashes = { x: [], y: [] };
  const other = axis === "x" ? "y" : "x";
  group.runs.forEach((_, place) => {
    const middle = group[axis][place];
    dashes[axis].push(middle - group.minus[place], middle + group.plus[place], null);
    dashes[other].push(group[other][place], group[other][place], null);
  });
  const line = { color: colour, width: 1.2, dash: "2px,2px" };
  return [{ type: "scatter", mode: "lines", ...dashes, line, hoverinfo: "skip" }, points];
}

// Curves of runs, those of a family in one line with gaps: a thousand lines would be slow.
function curveTraces(name, logarithmic, dashed) {
  const traces = [];
  families().forEach(({ colour, runs }) => {
    [false, true].forEach((isDashed) => {
      const line = { x: [], y: [], runs: [], text: [] };
      runs.forEach((run) => {
        if (dashed(run) !== isDashed) return;
        const { x, y } = curve(name, run);
        x.forEach((place, point) => {
          const drawn = !logarithmic || y[point] > 0;
          line.x.push(place);
          line.y.push(drawn ? y[point] : null);
        });
        line.x.push(null);
        line.y.push(null);
        while (line.runs.length < line.x.length) {
          line.runs.push(run);
          line.text.push(label(run));
        }
      });
      if (line.x.length) traces.push(lineTrace(line, colour, isDashed, RUNS.length > 100 ? 0.8 : 1.4));
    });
  });
  return traces;
}

function lineTrace(line, colour, dashed, width) {
  return {
    type: "scatter",
    mode: "lines",
    x: line.x,
    y: line.y,
    customdata: line.runs,
    text: line.text,
    hovertemplate: "%{text}<extra></extra>",
    line: { color: colour, width, dash: dashed ? "5px,2px" : "solid" },
  };
}

// What marks the chosen run in a panel: a frame around its point, or a line over its curve. Shapes
// can be moved without drawing the rest again.
const FRAME = "M-9,-9L9,-9L9,9L-9,9Z";

function frame(x, y) {
  const [left, up] = [x.values[chosen.run], y.values[chosen.run]];
  const isDrawn = (value) => Number.isFinite(value) && (!chosen.logarithmic || value > 0);
  if (!isDrawn(left) || !isDrawn(up)) return [];
  const place = { xsizemode: "pixel", ysizemode: "pixel", xanchor: left, yanchor: up };
  return [{ type: "path", path: FRAME, ...place, line: { color: "black", width: 2 } }];
}

function overline(name, logarithmic) {
  const { x, y } = curve(name, chosen.run);
  let pen = "M";
  let path = "";
  y.forEach((value, point) => {
    const drawn = Number.isFinite(value) && (!logarithmic || value > 0);
    if (drawn) path += `${pen}${x[point]},${value}`;
    pen = drawn ? "L" : "M";
  });
  return path ? [{ type: "path", path, line: { color: "black", width: 3 } }] : [];
}

const MARKS = {};

function marksOf(id) {
  const isShown = chosen.run !== null && shownRuns().includes(chosen.run);
  return isShown ? MARKS[id]() : [];
}

function moveMarks() {
  Object.keys(MARKS).forEach((id) => Plotly.relayout(byId(id), { shapes: marksOf(id) }));
}

function draw(id, traces, marks, axes, notes) {
  const plot = byId(id);
  const isNew = !plot.data;
  MARKS[id] = marks;
  const more = { uirevision: String(chosen.logarithmic), shapes: marksOf(id) };
  Plotly.react(plot, traces, layout(...axes, more), CONFIG);
  halveMarkers(plot);
  byId(`${id}-note`).textContent = notes.filter(Boolean).join(" ");
  if (!isNew) return;
  plot.on("plotly_afterplot", () => halveMarkers(plot));
  plot.on("plotly_click", (event) => choose(event.points[0].customdata, true));
}

function hiddenNote(hidden) {
  if (!hidden) return "";
  return `Not positive and not drawn on the logarithmic axes: ${hidden} of these runs.`;
}

function thinnedNote(name) {
  const { share, tolerance } = curves(name);
  const file = name in RATE_NAMES ? "creep.nc" : "profiles.nc";
  if (!tolerance) return "";
  return (
    `Drawn through ${(100 * share).toFixed(0)} % of the points; the others lie within ` +
    `${100 * tolerance} % of the axes of the lines, and are in ${file}.`
  );
}

function quantityColumn(name, symbol) {
  return { name, symbol, values: column(name), error: column(`${name}_error`) };
}

function drawFlowCurve() {
  const rate = byId("rate").value;
  const x = quantityColumn(rate, RATE_NAMES[rate]);
  const y = quantityColumn("shear_stress", "σ");
  const { traces, hidden } = pointTraces(x, y, { ...x, axis: "x" });
  const axes = [
    axisLayout(`${x.symbol} [${DATA.quantities[rate][0]}]`, chosen.logarithmic),
    axisLayout(`σ [${DATA.quantities.shear_stress[0]}]`, chosen.logarithmic),
  ];
  draw("flow-curve", traces, () => frame(x, y), axes, [hiddenNote(hidden)]);
}

function drawSlip() {
  const x = quantityColumn("shear_stress", "σ");
  const y = quantityColumn("slip_velocity", "V<sub>s</sub>");
  const { traces, hidden } = pointTraces(x, y, { ...y, axis: "y" });
  const axes = [
    axisLayout(`σ [${DATA.quantities.shear_stress[0]}]`, chosen.logarithmic),
    axisLayout(`V<sub>s</sub> [${DATA.quantities.slip_velocity[0]}]`, chosen.logarithmic),
  ];
  draw("slip", traces, () => frame(x, y), axes, [hiddenNote(hidden)]);
}

function drawCreep() {
  const rate = byId("creep-rate").value;
  const { along_quantity, quantity } = curves(rate);
  const traces = curveTraces(rate, chosen.logarithmic, () => false);
  const axes = [
    axisLayout(`t [${along_quantity[0]}]`, chosen.logarithmic),
    axisLayout(`${RATE_NAMES[rate]} [${quantity[0]}]`, chosen.logarithmic),
  ];
  const mark = () => overline(rate, chosen.logarithmic);
  draw("creep", traces, mark, axes, [thinnedNote(rate)]);
}

function drawProfiles() {
  const name = "normalised_velocity";
  const drifts = (run) => states("shear_rate_wall")[run] === DRIFTING;
  const traces = curveTraces(name, false, drifts);
  const axes = [axisLayout("y / H", false), axisLayout("v<sub>norm</sub>", false)];
  const dashed = shownRuns().some(drifts) ? "Dashed: walls not steady." : "";
  draw("profiles", traces, () => overline(name, false), axes, [dashed, thinnedNote(name)]);
}

function buildPanels() {
  [
    ["rate", drawFlowCurve],
    ["creep-rate", drawCreep],
  ].forEach(([id, redraw]) => {
    const select = byId(id);
    Object.entries(RATE_WORDS).forEach(([value, textContent]) => {
      select.append(element("option", { value, textContent }));
    });
    select.addEventListener("change", redraw);
  });
}

function drawPanels() {
  drawFlowCurve();
  drawSlip();
  drawCreep();
  drawProfiles();
}
