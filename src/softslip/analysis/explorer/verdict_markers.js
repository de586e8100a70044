"use strict";
// Points by the verdict on their steady state: filled, half filled, or open with a dashed bar.

const STATES = Object.keys(DATA.verdicts);
const [STEADY, WITHIN_ERROR, DRIFTING] = [0, 1, 2];
const MARKER_SIZE = 8;
// An error bar that reaches zero ends at this share of its value on a logarithmic axis.
const LEAST_SHARE = 0.01;

function marker(state, colour, symbol) {
  return {
    symbol,
    size: MARKER_SIZE,
    color: state === STEADY ? colour : "white",
    line: { color: colour, width: 1.4 },
    ...(state === WITHIN_ERROR ? { gradient: { type: "vertical", color: colour } } : {}),
  };
}

// Markers are half filled by a gradient whose two colours meet in the middle.
function halveMarkers(plot) {
  plot.querySelectorAll(".gradients stop").forEach((stop) => stop.setAttribute("offset", "50%"));
}

const SHAPES = {
  circle: "M8 3.5a4.5 4.5 0 1 0 .01 0z",
  square: "M4 4h8v8h-8z",
  "triangle-up": "M8 3l5 9h-10z",
  diamond: "M8 2.5l5 5.5l-5 5.5l-5-5.5z",
  "triangle-down": "M8 13l5-9h-10z",
  cross: "M6 3h4v3h3v4h-3v3h-4v-3h-3v-4h3z",
  x: "M5 3l3 3l3-3l2 2l-3 3l3 3l-2 2l-3-3l-3 3l-2-2l3-3l-3-3z",
  pentagon: "M8 3l5 3.8l-1.9 6.2h-6.2l-1.9-6.2z",
};

// A small picture of a marker, for legends.
function icon(state, colour, symbol) {
  const shape = SHAPES[symbol];
  const bar =
    state === DRIFTING
      ? `<path d="M1 8h14" stroke="${colour}" stroke-dasharray="2 1.5" stroke-width="1.2"/>`
      : "";
  const fill = state === STEADY ? colour : "white";
  const half =
    state === WITHIN_ERROR
      ? `<path d="${shape}" fill="${colour}" style="clip-path: inset(50% 0 0 0)"/>`
      : "";
  return (
    `<svg width="16" height="16" viewBox="0 0 16 16" aria-hidden="true">${bar}` +
    `<path d="${shape}" fill="${fill}"/>${half}` +
    `<path d="${shape}" fill="none" stroke="${colour}" stroke-width="1.4"/></svg>`
  );
}

// Ends of an error bar below and above a value.
function bars(value, error, logarithmic) {
  const size = Number.isFinite(error) ? error : 0;
  return [logarithmic ? Math.min(size, (1 - LEAST_SHARE) * value) : size, size];
}
