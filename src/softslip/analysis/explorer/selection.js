"use strict";
// Which runs are shown, what colours stand for, and which run is chosen.

const byId = (id) => document.getElementById(id);

const chosen = {
  // Of each axis the places of the values that are shown.
  values: DATA.axes.map((axis) => new Set(axis.values.keys())),
  colours: Math.max(0, DATA.axes.findIndex((axis) => axis.name === DATA.colours)),
  logarithmic: true,
  run: null,
};

function shownRuns() {
  return RUNS.filter((run) =>
    chosen.values.every((places, number) => places.has(axisPlaces(number)[run])),
  );
}

// The groups of runs that share a colour and a marker.
function families() {
  const axis = DATA.axes[chosen.colours];
  if (!axis) return [{ colour: "#0072B2", symbol: "circle", runs: shownRuns() }];
  const places = axisPlaces(chosen.colours);
  const found = axis.values.map((_, place) => ({
    colour: axis.colours[place],
    symbol: axis.markers[place],
    name: `${symbolOf(axis)} = ${escaped(axisValue(axis, place))}`,
    runs: [],
  }));
  shownRuns().forEach((run) => found[places[run]].runs.push(run));
  return found.filter((family) => family.runs.length);
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  Object.entries(attributes).forEach(([key, value]) => {
    if (key === "html") made.innerHTML = value;
    else if (key in made) made[key] = value;
    else made.setAttribute(key, value);
  });
  made.append(...children);
  return made;
}

function filterOf(axis, number) {
  const places = chosen.values[number];
  const boxes = axis.values.map((_, place) => {
    const box = element("input", { type: "checkbox", checked: true });
    box.addEventListener("change", () => {
      places[box.checked ? "add" : "delete"](place);
      refresh();
    });
    return box;
  });
  const setAll = (checked) => {
    boxes.forEach((box, place) => {
      box.checked = checked;
      places[checked ? "add" : "delete"](place);
    });
    refresh();
  };
  const lines = boxes.map((box, place) =>
    element("label", {}, box, element("span", { textContent: axisValue(axis, place) })),
  );
  const buttons = [
    ["all", true],
    ["none", false],
  ].map(([words, checked]) => {
    const button = element("button", { type: "button", textContent: words });
    button.setAttribute("aria-label", `${words} values of ${axis.name}`);
    button.addEventListener("click", () => setAll(checked));
    return button;
  });
  // Sentences on special values go into the tooltip.
  const meaning = axis.meaning.split(";")[0].replace(/^./, (letter) => letter.toLowerCase());
  const unit = axis.unit === "1" || !axis.unit ? "" : `, ${axis.unit}`;
  return element(
    "fieldset",
    { name: axis.name },
    element("legend", {
      title: axis.meaning,
      html: `${symbolOf(axis)} <small>${escaped(meaning)}${unit}</small>`,
    }),
    element("div", { className: "values" }, ...lines),
    element("div", { className: "values-buttons" }, ...buttons),
  );
}

function buildFilters() {
  const form = byId("filters");
  const colours = element("select", { id: "colours" });
  DATA.axes.forEach((axis, number) => {
    const name = axis.name.replaceAll("_", " ");
    colours.append(element("option", { value: number, textContent: name }));
  });
  colours.value = String(chosen.colours);
  colours.addEventListener("change", () => {
    chosen.colours = Number(colours.value);
    refresh();
  });
  const logarithmic = element("input", { type: "checkbox", checked: true, id: "logarithmic" });
  logarithmic.addEventListener("change", () => {
    chosen.logarithmic = logarithmic.checked;
    refresh();
  });
  const words = element("span", { textContent: "logarithmic axes" });
  if (DATA.axes.length) {
    const heading = element("legend", { textContent: "Colours stand for" });
    colours.setAttribute("aria-label", "Colours stand for");
    form.append(element("fieldset", {}, heading, colours));
  }
  form.append(element("label", { className: "option" }, logarithmic, words));
  form.append(...DATA.axes.map(filterOf));
  form.addEventListener("submit", (event) => event.preventDefault());
  if (matchMedia("(max-width: 760px)").matches) byId("controls").open = false;
}

function drawLegend() {
  const found = families();
  const values = found
    .filter((family) => family.name)
    .map(({ colour, symbol, name }) => `<span>${icon(STEADY, colour, symbol)} ${name}</span>`);
  const verdicts = STATES.map(
    (name, state) => `<span>${icon(state, "#333", "circle")} ${DATA.verdicts[name]}</span>`,
  );
  byId("legend").innerHTML = [...values, ...verdicts].join("");
  const shown = shownRuns().length;
  byId("count").textContent = `${shown} of ${RUNS.length} runs are shown`;
}
