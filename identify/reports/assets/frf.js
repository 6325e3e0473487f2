// FRF overlays and the gap map: one FRF is unpacked and drawn at a time.
"use strict";

const FRF = (() => {
  const sets = (DATA.measurements || []).filter(m => m.frf);
  if (!sets.length || !$("frf-plot")) return null;
  const unpacked = new Map();
  let set = sets[0], mapped = sets[0], pair = 0, shown = 0, marked = {};

  // A block of FRFs, unpacked once and kept, and the row of one of them.
  async function blockOf(chosen, number) {
    const {size, blocks} = chosen.frf.curves, index = Math.floor(number / size), key = `${chosen.name}/${index}`;
    if (!unpacked.has(key)) {
      const inflate = async value => value.data ? unpack(value)
        : Object.fromEntries(await Promise.all(Object.entries(value).map(async ([name, part]) => [name, await inflate(part)])));
      unpacked.set(key, inflate(blocks[index]));
    }
    return [await unpacked.get(key), number % size];
  }

  // What was measured of some FRFs at one line: magnitude, and phase in radians.
  const at = (chosen, numbers, line) => Promise.all(numbers.map(async number => {
    const [{measured}, row] = await blockOf(chosen, number);
    return {magnitude: 10 ** measured.magnitude[row][line], phase: measured.phase[row][line]};
  }));

  // The curves of one FRF.
  async function curves(chosen, number) {
    const [block, row] = await blockOf(chosen, number);
    const curve = name => ({magnitude: block[name].magnitude[row].map(v => 10 ** v), phase: wrapped(block[name].phase[row])});
    return {
      ...Object.fromEntries(Object.keys(DATA.curves).filter(name => block[name]).map(name => [name, curve(name)])),
      band: block.band ? block.band[row].map(v => 10 ** v) : null, coherence: block.coherence ? block.coherence[row] : null,
    };
  }

  // Degrees within -180 to 180, with a gap in the line where it jumps.
  function wrapped(radians) {
    const degrees = Array.from(radians, r => (((r * 180 / Math.PI + 180) % 360) + 360) % 360 - 180);
    return degrees.map((d, i) => i && Math.abs(d - degrees[i - 1]) > 270 ? NaN : d);
  }

  function bandTraces(frequency, fitted, band, phases) {
    const width = phases
      ? band.map((b, i) => Math.asin(Math.min(1, b / fitted.magnitude[i])) * 180 / Math.PI)
      : band;
    const line = phases ? fitted.phase : fitted.magnitude;
    const low = Array.from(line, (v, i) => phases ? v - width[i] : Math.max(v - width[i], v * 1e-3));
    const high = Array.from(line, (v, i) => v + width[i]);
    const common = {x: frequency, mode: "lines", line: {width: 0, simplify: false}, hoverinfo: "skip", yaxis: phases ? "y2" : "y", legendgroup: "band"};
    return [
      {...common, y: low, showlegend: false},
      {...common, y: high, fill: "tonexty", fillcolor: color("band"), name: "95 % band", showlegend: !phases},
    ];
  }

  function traces(c) {
    const x = set.frf.frequency, made = [], further = Object.keys(DATA.curves).filter(name => c[name] && !["measured", "fitted", "initial"].includes(name));
    const styles = {
      measured: {line: {color: color("measured"), width: 1, simplify: false}, mode: x.length > 400 ? "lines" : "lines+markers", marker: {size: 4.5, color: color("measured")}},
      initial: c.initial && {line: {color: color("initial"), width: 1.5, dash: "dash", simplify: false}, mode: "lines", visible: $("frf-initial").checked},
      fitted: {line: {color: color("fitted"), width: 2, simplify: false}, mode: "lines"},
      ...Object.fromEntries(further.map((name, i) => [name, {line: {color: PALETTE[(i + 1) % PALETTE.length], width: 1.5, dash: ["dash", "dashdot", "dot"][i % 3], simplify: false}, mode: "lines"}])),
    };
    for (const phases of [false, true]) {
      if (c.band) made.push(...bandTraces(x, c.fitted, c.band, phases));
      for (const [name, style] of Object.entries(styles).filter(entry => entry[1]))
        made.push({...style, name: DATA.curves[name], x, y: phases ? c[name].phase : c[name].magnitude, yaxis: phases ? "y2" : "y", legendgroup: name, showlegend: !phases, hovertemplate: phases ? "%{y:.1f}°" : "%{y:.3g} " + set.frf.unit});
    }
    if (c.coherence) made.push({x, y: c.coherence, yaxis: "y3", name: "coherence", mode: "lines", line: {color: color("coherence"), width: 1.5, simplify: false}, hovertemplate: "%{y:.3f}"});
    return made;
  }

  function layout(c) {
    const bottom = c.coherence ? 0.17 : 0, middle = c.coherence ? 0.21 : 0;
    return {
      margin: {l: 76, r: 16, t: 40, b: 48}, hovermode: "x unified", hoversubplots: "axis", uirevision: set.name,
      legend: {orientation: "h", x: 0, y: 1.01, yanchor: "bottom"}, shapes: marks(),
      xaxis: {title: {text: "Frequency (Hz)"}, anchor: c.coherence ? "y3" : "y2", range: [set.frf.frequency[0], set.frf.frequency.at(-1)], ticksuffix: "", unifiedhovertitle: {text: "%{x:.4g} Hz"}},
      yaxis: {title: {text: `Magnitude (${set.frf.unit})`}, type: $("frf-scale").value, domain: [middle + 0.31, 1], exponentformat: "power", ...($("frf-scale").value === "log" && {dtick: 1, tickfont: {size: 10.5}}), uirevision: `${set.name} ${pair} ${$("frf-scale").value}`},
      yaxis2: {title: {text: "Phase (°)"}, range: [-190, 190], tickvals: [-180, -90, 0, 90, 180], domain: [middle, middle + 0.26], zeroline: false},
      ...(c.coherence && {yaxis3: {title: {text: "Coherence (–)"}, range: [0, 1.05], tickvals: [0, 0.5, 1], domain: [0, bottom], zeroline: false}}),
    };
  }

  // The line whose motion is shown, in the plot of its measurement.
  const marks = () => marked.set === set ? [{type: "line", x0: marked.hz, x1: marked.hz, yref: "paper", y0: 0, y1: 1, line: {color: color("muted"), width: 1, dash: "dot"}}] : [];
  function mark(chosen, hz) {
    marked = {set: chosen, hz};
    if ($("frf-plot").data) Plotly.relayout("frf-plot", {shapes: marks()});
  }

  const chooseLine = event => window.dispatchEvent(new CustomEvent("line", {detail: {name: set.name, hz: event.points[0].x, input: set.frf.input[pair]}}));

  async function show() {
    const turn = ++shown, c = await curves(set, pair);
    if (turn !== shown) return;
    $("frf-title").textContent = `${set.name}, ${set.frf.quantity} ${set.frf.output[pair]} / ${set.frf.input[pair]}: ${set.frf.title[pair]}`;
    draw("frf-plot", () => [traces(c), layout(c)], plot => plot.on("plotly_click", chooseLine));
  }

  const unique = list => [...new Set(list)];
  const options = (id, list, value) => {
    $(id).replaceChildren(...list.map(text => new Option(text, text)));
    $(id).value = value;
  };
  const find = (output, input) => set.frf.output.findIndex((o, i) => o === output && set.frf.input[i] === input);

  function pick(name, number) {
    set = sets.find(m => m.name === name);
    pair = number;
    const {output, input} = set.frf;
    $("frf-measurement").value = name;
    options("frf-output", unique(output), output[pair]);
    options("frf-input", unique(input.filter((_, i) => output[i] === output[pair])), input[pair]);
    return show();
  }

  function pickOutput() {
    const output = $("frf-output").value, same = find(output, $("frf-input").value);
    return pick(set.name, same >= 0 ? same : set.frf.output.indexOf(output));
  }

  // The same channels in another measurement where it has them.
  function pickSet() {
    const {output, input} = set.frf, before = pair;
    set = sets.find(m => m.name === $("frf-measurement").value);
    const same = find(output[before], input[before]);
    return pick(set.name, same >= 0 ? same : set.frf.first);
  }

  const step = by => pick(set.name, (pair + by + set.frf.output.length) % set.frf.output.length);
  $("frf-measurement").addEventListener("change", pickSet);
  $("frf-output").addEventListener("change", pickOutput);
  $("frf-input").addEventListener("change", () => pick(set.name, find($("frf-output").value, $("frf-input").value)));
  $("frf-back").addEventListener("click", () => step(-1));
  $("frf-next").addEventListener("click", () => step(1));
  $("frf-scale").addEventListener("change", show);
  $("frf-initial")?.addEventListener("change", show);

  async function jump(name, number) {
    await pick(name, number);
    $("frf").scrollIntoView();
  }

  // Rows of the error tables lead to their FRF.
  sets.forEach((m, i) => {
    document.querySelector(`table[data-sort="frf-${i}"] tbody`)?.addEventListener("click", event => {
      const cells = event.target.closest("tr").cells, [output, input] = [cells[0].textContent, cells[1].textContent];
      jump(m.name, m.frf.output.findIndex((o, k) => o === output && m.frf.input[k] === input));
    });
  });

  // Neutral is the noise level, blue below, orange above; equally far on both sides.
  const noiseScale = () => [[0, color("cold")], [0.25, color("cool")], [0.5, color("neutral")], [0.75, color("warm")], [1, color("hot")]];
  const plainScale = () => [[0, color("neutral")], [0.5, color("warm")], [1, color("hot")]];

  async function showMap() {
    mapped = sets.find(s => s.name === $("gap-measurement").value);
    const {map, output, input} = mapped.frf;
    const z = (await unpack(map.values)).map(row => Array.from(row));
    const top = z.flat().reduce((most, v) => v > most ? v : most, 0), reach = Math.max(Math.log10(4), Math.min(top, 2));
    const limits = map.in_noise ? [-reach, reach] : [-3, Math.max(0, Math.min(top, 1))];
    const ticks = [0.001, 0.01, 0.1, 0.25, 0.5, 1, 2, 4, 10, 30, 100].filter(t => Math.log10(t) >= limits[0] - 1e-9 && Math.log10(t) <= limits[1] + 1e-9);
    const what = map.in_noise ? "Residual / noise (1 = noise)" : "Residual / measured";
    const labels = map.order.map(i => `${output[i]} / ${input[i]}`);
    const row = Math.min(16, 780 / labels.length);
    draw("gap-plot", () => [[{
      type: "heatmap", x: map.edges, y: labels.map((_, i) => i), z, zmin: limits[0], zmax: limits[1], colorscale: map.in_noise ? noiseScale() : plainScale(),
      text: labels.map(text => map.edges.slice(1).map(() => text)), customdata: z.map(row => row.map(v => 10 ** v)),
      hovertemplate: "%{text}<br>near %{x:.3g} Hz: %{customdata:.3g}<extra></extra>",
      colorbar: colorBar(what.replaceAll(" / ", "<br>/ ").replace(" (", "<br>("), {tickvals: ticks.map(Math.log10), ticktext: ticks.map(String)}),
    }], {
      height: Math.max(260, 110 + row * labels.length), margin: {l: 110, r: 16, t: 34, b: 48},
      xaxis: {title: {text: "Frequency (Hz)"}, showgrid: false},
      yaxis: {title: {text: "Output / input channel", standoff: 12}, autorange: "reversed", showgrid: false, zeroline: false, ...mapTicks(labels, map.order.map(i => input[i]), Math.ceil(13 / row))},
    }], plot => plot.on("plotly_click", event => jump(mapped.name, mapped.frf.map.order[event.points[0].y])));
  }

  // Every so many rows a label, and always at the first of each input.
  function mapTicks(labels, inputs, every) {
    const last = inputs.map(input => inputs.lastIndexOf(input));
    const at = labels.map((_, i) => i).filter(i => {
      const from = i - inputs.indexOf(inputs[i]);
      return from % every === 0 && (from === 0 || last[i] - i >= every - 1);
    }).reduce((kept, i) => kept.length && i - kept.at(-1) < every ? kept : [...kept, i], []);
    return {tickvals: at, ticktext: at.map(i => labels[i])};
  }

  const mapReady = $("gap-measurement") ? showMap() : null;
  $("gap-measurement")?.addEventListener("change", showMap);
  return {ready: Promise.all([pick(sets[0].name, sets[0].frf.first), mapReady]), pick, at, mark};
})();
