// The measured motion at one line (operating deflection shape): every response to one force, as displacements, on the points.
"use strict";

(() => {
  if (!ROBOT || !FRF || !$("robot-line")) return;
  const POWER = {receptance: 0, mobility: 1, accelerance: 2};
  const [slider, picker, said] = [$("robot-line"), $("robot-force"), $("robot-line-hz")];
  let set = null, turn = 0;

  const nearest = hz => set.frf.frequency.reduce((best, f, i) => Math.abs(f - hz) < Math.abs(set.frf.frequency[best] - hz) ? i : best, 0);
  const known = ways => set.frf.output.map((output, pair) => ({pair, way: ways[output]})).filter(one => one.way && set.frf.input[one.pair] === picker.value);

  // Another measurement, or another mode: the forces that it has, and the line nearest to the mode.
  function follow() {
    const {name, hz} = ROBOT.chosen(), next = DATA.measurements.find(m => m.name === name && m.frf);
    if (next !== set) {
      set = next || null;
      slider.disabled = picker.disabled = !set;
      picker.replaceChildren(...(set ? [...new Set(set.frf.input)] : []).map(text => new Option(text, text)));
      slider.max = set ? set.frf.frequency.length - 1 : 0;
    }
    if (!set) return ROBOT.move(null, "no FRFs");
    if (hz !== null && hz !== undefined) slider.value = nearest(hz);
    show();
  }

  async function show() {
    const now = ++turn, line = Number(slider.value), hz = set.frf.frequency[line], {ways, points} = ROBOT.chosen();
    said.textContent = `${hz.toPrecision(4)} Hz`;
    const pairs = known(ways), values = await FRF.at(set, pairs.map(one => one.pair), line);
    if (now !== turn) return;
    FRF.mark(set, hz);
    // Displacement: over (j omega)^p, which turns it by -90 degrees each time.
    const power = POWER[set.frf.quantity] || 0, size = (2 * Math.PI * hz) ** power, quarter = -power * Math.PI / 2;
    const shape = {real: Array.from({length: points}, () => [null, null, null]), imag: Array.from({length: points}, () => [null, null, null])};
    pairs.forEach(({way: [row, ...way]}, i) => {
      const {magnitude, phase} = values[i], part = {real: magnitude / size * Math.cos(phase + quarter), imag: magnitude / size * Math.sin(phase + quarter)};
      if (isNaN(part.real)) return;
      for (const side of ["real", "imag"]) shape[side][row] = shape[side][row].map((v, k) => (v || 0) + part[side] * way[k]);
    });
    const lengths = shape.real.map((real, i) => real[0] === null ? 0 : Math.hypot(...real, ...shape.imag[i])), most = Math.max(...lengths);
    if (!(most > 0)) return ROBOT.move(null, `no response along known directions to a force at ${picker.value}`);
    for (const side of ["real", "imag"]) shape[side] = shape[side].map(row => row[0] === null ? row : row.map(v => 1000 * v / most));
    const much = set.frf.quantity in POWER ? `, largest ${(1e6 * most).toPrecision(3)} µm/N` : "";
    ROBOT.move(shape, `measured at ${hz.toPrecision(4)} Hz, ${set.frf.quantity in POWER ? "force" : "reference"} ${picker.value}${much}`);
  }

  slider.addEventListener("input", show);
  picker.addEventListener("change", show);
  window.addEventListener("mode", follow);
  // A click in the plot of an FRF chooses its line, and its force.
  window.addEventListener("line", event => {
    const {name, hz, input} = event.detail;
    if ($("robot-measurement").value !== name) {
      $("robot-measurement").value = name;
      $("robot-measurement").dispatchEvent(new Event("change"));
    }
    if (!set || set.name !== name) return;
    picker.value = input;
    slider.value = nearest(hz);
    show();
  });
  follow();
})();
