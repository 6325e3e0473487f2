// What all parts of the page share: data, colours, plots that follow the theme, tables that sort.
"use strict";

const DATA = JSON.parse(document.getElementById("data").textContent);
const $ = id => document.getElementById(id);
const color = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
// Okabe and Ito's colours: told apart by colour-blind readers, on paper and on a dark screen.
const PALETTE = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7f7f7f"];

// The way back from packing.py: inflate, join the byte planes, undo zigzag and differences; rows of NaN-able numbers.
async function unpack(packed) {
  const deflated = Uint8Array.from(atob(packed.data), c => c.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const size = bytes.length / 4, rows = [];
  const steps = new Int32Array(packed.n);
  for (let first = 0; first < size; first += packed.n) {
    for (let i = 0, k = first; i < packed.n; i++, k++) {
      const u = bytes[k] | bytes[k + size] << 8 | bytes[k + 2 * size] << 16 | bytes[k + 3 * size] << 24;
      steps[i] = u >>> 1 ^ -(u & 1);
    }
    for (let order = 0; order < packed.order; order++) for (let i = 1; i < packed.n; i++) steps[i] += steps[i - 1];
    rows.push(Float64Array.from(steps, s => s === -2147483648 ? NaN : s * packed.step));
  }
  return rows;
}

// A bar of colours beside a map, with its title above it, clear of its numbers.
const colorBar = (title, more = {}) => ({title: {text: title, side: "top", font: {size: 12}}, thickness: 13, outlinewidth: 0, ...more});

const plots = new Map();
let printing = false, themeOnScreen = "light";

// Registers a plot; make returns [traces, layout].  It is drawn when it comes near the window, and again when it or the theme changes.
function draw(id, make, drawn = () => {}) {
  const before = plots.get(id);
  plots.set(id, {make, drawn, done: before !== undefined && before.done});
  if (plots.get(id).done) return render(id);
  const {height} = make()[1];
  if (height) $(id).style.minHeight = `${height}px`;
  nearing.observe($(id));
}

const nearing = new IntersectionObserver(entries => {
  for (const entry of entries) if (entry.isIntersecting) render(entry.target.id);
}, {rootMargin: "300px"});

function drawAll() {
  for (const id of plots.keys()) render(id);
}

function render(id) {
  const plot = plots.get(id), [traces, layout] = plot.make(), first = !plot.done;
  nearing.unobserve($(id));
  plot.done = true;
  const axes = Object.keys(layout).filter(key => /^[xy]axis/.test(key));
  const styled = Object.fromEntries(axes.map(key => [key, {
    gridcolor: color("grid"), zerolinecolor: color("line"), linecolor: color("line"), tickcolor: color("line"), ticks: "outside", automargin: true, ...layout[key],
    title: {font: {size: 13}, standoff: 10, ...layout[key].title},
  }]));
  const common = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", colorway: PALETTE,
    font: {family: getComputedStyle(document.body).fontFamily, size: 12.5, color: color("ink")},
    hoverlabel: {bgcolor: color("sheet"), bordercolor: color("line"), font: {color: color("ink")}},
    margin: {l: 64, r: 16, t: 34, b: 48}, modebar: {bgcolor: "rgba(0,0,0,0)", color: color("muted"), activecolor: color("accent")},
  };
  // Named one by one, because the library's own choice has a button that uploads the plot.
  const buttons = [["toImage"], ["zoom2d"], ["pan2d"], ["resetScale2d"]];
  // On a telephone the buttons would lie over legends; fingers zoom and pan without them.
  const config = {displaylogo: false, responsive: true, displayModeBar: window.innerWidth < 600 ? false : "hover", modeBarButtons: buttons, toImageButtonOptions: {format: "svg", filename: id}};
  Plotly.react(id, traces, {...common, ...layout, ...styled, ...(printing && {width: $(id).clientWidth})}, config);
  if (first) plot.drawn($(id));
}

// A logarithmic axis for these values: 1, 2, 5 over a few decades, powers of ten over many.
function logAxis(values, title) {
  const known = values.filter(v => v > 0), few = Math.max(...known) < 1e3 * Math.min(...known);
  if (few) return {title: {text: title}, type: "log", ...writtenOut(Math.min(...known), Math.max(...known))};
  return {title: {text: title}, type: "log", dtick: 1, exponentformat: "power", tickfont: {size: 10.5}};
}

// Ticks at 1, 2 and 5 of every decade in and around a range, at more within a factor of five; written out.
function writtenOut(low, high) {
  const first = Math.floor(Math.log10(low)), decades = Math.ceil(Math.log10(high)) - first + 1;
  const ticks = Array.from({length: decades}, (_, n) => (high < 5 * low ? [1, 1.5, 2, 3, 4, 5, 7] : [1, 2, 5]).map(t => Number(`${t}e${first + n}`))).flat();
  return {tickmode: "array", tickvals: ticks, ticktext: ticks.map(t => t < 1 ? String(t) : t.toLocaleString("en"))};
}

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  for (const [id, plot] of plots) if (plot.done) render(id);
  window.dispatchEvent(new Event("themed"));
}

const prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
document.documentElement.dataset.theme = prefersDark.matches ? "dark" : "light";
prefersDark.addEventListener("change", event => setTheme(event.matches ? "dark" : "light"));
$("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));

// Paper is white and 182 mm wide.
window.addEventListener("beforeprint", () => {
  themeOnScreen = document.documentElement.dataset.theme;
  document.body.style.width = "688px";
  printing = true;
  drawAll();
  setTheme("light");
});
window.addEventListener("afterprint", () => {
  document.body.style.width = "";
  printing = false;
  setTheme(themeOnScreen);
});

const known = text => text === "–" ? NaN : parseFloat(text);

function sortTable(table, column, numeric) {
  const body = table.tBodies[0], heading = table.tHead.rows[0].cells[column];
  const down = heading.getAttribute("aria-sort") === "ascending" || numeric && heading.getAttribute("aria-sort") === null;
  const text = row => row.cells[column].textContent;
  const compare = numeric
    ? (a, b) => { const x = known(text(a)), y = known(text(b)); return isNaN(x) - isNaN(y) || (down ? y - x : x - y) || 0; }
    : (a, b) => (down ? -1 : 1) * text(a).localeCompare(text(b), "en", {numeric: true});
  body.append(...[...body.rows].sort(compare));
  for (const cell of table.tHead.rows[0].cells) cell.removeAttribute("aria-sort");
  heading.setAttribute("aria-sort", down ? "descending" : "ascending");
}

for (const table of document.querySelectorAll("table[data-sort]"))
  [...table.tHead.rows[0].cells].forEach((cell, column) =>
    cell.addEventListener("click", () => sortTable(table, column, cell.classList.contains("n"))));
