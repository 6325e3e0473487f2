// The plots of a discovery alone: where each step saw the gap, what it tried, the fall of the gap, and the gap by band and channel.
"use strict";

(() => {
  const GAP = "Gap: residual / noise (1 = noise)";
  const STANDING = [{color: PALETTE[0], symbol: "circle"}, {color: PALETTE[4], symbol: "diamond"}, {color: PALETTE[7], symbol: "circle"}];
  const upright = (x, dash = "dot", shade = "muted") => ({type: "line", yref: "paper", x0: x, x1: x, y0: 0, y1: 1, line: {color: color(shade), dash, width: 1.2}});
  // A long name goes on in further lines: what is cut off would be the place.
  const short = (text, most = 42) => text.split(" ").reduce((lines, word) => (lines.at(-1) + word).length > most ? [...lines, word] : [...lines.slice(0, -1), `${lines.at(-1)} ${word}`.trim()], [""]).join("<br>");
  const tall = names => Math.max(25, 4 + 14 * Math.max(...names.map(name => short(name).split("<br>").length)));  // a row of so many lines
  const narrow = id => $(id).clientWidth < 560;  // a telephone: one panel above the other
  const rows = (names, reverse = true, most = 42) => ({
    tickmode: "array", tickvals: names.map((_, i) => i), ticktext: names.map(name => short(name, most)), range: reverse ? [names.length - 0.4, -0.6] : undefined, zeroline: false, showgrid: false, ticks: "", tickfont: {size: 11.5},
  });
  const decades = (low, high, title) => ({title: {text: title}, type: "log", range: [Math.log10(low), Math.log10(high)], ...writtenOut(low, high)});
  // Gaps from noise up, wide apart on a logarithmic axis.
  const gapAxis = (wide, values, room, ahead = 0.45 * room) => {
    const known = values.filter(v => v !== null), low = Math.min(1, ...known), high = Math.max(1, ...known);
    return wide ? decades(low / 10 ** (ahead + 0.02), high * 10 ** room, GAP)
      : {title: {text: GAP}, range: [low - Math.max(0.12, 0.8 * ahead) * (high - low + 0.1), high + (0.3 + room) * (high - low + 0.1)], zeroline: false};
  };

  DATA.steps.forEach((step, k) => {
    step.parts.forEach((part, i) => draw(`parts-${k}-${i}`, () => [[{
      type: "bar", orientation: "h", x: part.gap, y: part.names.map((_, n) => n), text: part.share, textposition: "outside", cliponaxis: false, customdata: part.names, width: 0.72,
      marker: {color: PALETTE[0]}, textfont: {size: 11, color: color("ink")}, hovertemplate: "%{customdata}: gap %{x:.3g}, share %{text}<extra></extra>",
    }], {
      title: {text: part.title, font: {size: 13}, x: 0, xref: "container", xanchor: "left", y: 1, yref: "container", yanchor: "top", pad: {t: 6}},
      height: 92 + 19 * part.names.length, margin: {l: 90, r: 34, t: 30, b: 44}, showlegend: false,
      xaxis: {title: {text: "Gap (1 = noise)"}, range: [0, 1.18 * step.most], nticks: 6}, yaxis: rows(part.names), shapes: [upright(1)],
    }]));

    const o = step.options;
    if (!o.names.length) return;
    draw(`options-${k}`, () => {
      const tight = narrow(`options-${k}`), y = o.names.map((_, i) => i), stems = values => values.flatMap(v => v), tried = o.evidence.map(v => v !== null);
      const look = {color: o.standing.map(s => STANDING[s].color), symbol: o.standing.map(s => STANDING[s].symbol)};
      const high = Math.max(100, ...o.evidence.filter(v => v !== null)), worth = o.evidence.map(v => v === null ? null : Math.max(v, 1));
      return [[
        {x: stems(o.gap.map(v => [v, step.gap, null])), y: stems(y.map(i => [i, i, null])), mode: "lines", line: {color: color("line"), width: 5, simplify: false}, hoverinfo: "skip", showlegend: false},
        {x: o.gap, y, customdata: o.names, mode: "markers", name: "gap on fitted data", marker: {...look, size: 10}, showlegend: false, hovertemplate: "%{customdata}: gap %{x:.4g} on fitted data<extra></extra>"},
        {x: o.other, y, customdata: o.names, mode: "markers", name: "on other data", marker: {symbol: "circle-open", size: 15, color: color("ink"), line: {width: 1.4}}, hovertemplate: "%{customdata}: gap %{x:.4g} on other data<extra></extra>"},
        {x: stems(worth.map(v => [1, v, null])), y: stems(y.map(i => [i, i, null])), xaxis: "x2", yaxis: tight ? "y2" : "y", mode: "lines", line: {color: color("line"), width: 5, simplify: false}, hoverinfo: "skip", showlegend: false},
        {x: worth, y, xaxis: "x2", yaxis: tight ? "y2" : "y", customdata: o.evidence, mode: "markers", marker: {...look, size: 10}, showlegend: false, hovertemplate: "log odds %{customdata:.4g}<extra></extra>"},
        {x: o.names.filter((_, i) => !tried[i]).map(() => 1), y: y.filter(i => !tried[i]), xaxis: "x2", yaxis: tight ? "y2" : "y", mode: "text", text: y.map(() => "ruled out"), textposition: "middle right", textfont: {size: 11, color: color("muted")}, hoverinfo: "skip", showlegend: false},
        ...o.standings.map((name, s) => ({x: [null], y: [0], mode: "markers", name, marker: {...STANDING[s], size: 10}, showlegend: o.standing.includes(s)})),
      ], {
        height: tight ? 290 + 116 * y.length : 128 + tall(o.names) * y.length, margin: {l: tight ? 130 : 250, r: 16, t: tight ? 120 : 40, b: 48}, legend: {orientation: "h", x: 0, y: 1, yanchor: "bottom"},
        xaxis: {...gapAxis(o.wide, [...o.gap, ...o.other, step.gap], 0.08), domain: [0, tight ? 1 : 0.56], anchor: "y"},
        xaxis2: {...(high > 1e3 ? {...logAxis([1, 1e4], "Log odds (–)"), dtick: Math.ceil(Math.log10(high) / 5), range: [-0.06, Math.log10(high) + 0.2]} : decades(0.87, 1.6 * high, "Log odds (–)")), domain: [tight ? 0 : 0.62, 1], anchor: tight ? "y2" : "y"},
        yaxis: {...rows(o.names, true, tight ? 20 : 42), anchor: "x", domain: tight ? [0.58, 1] : [0, 1]},
        ...(tight && {yaxis2: {...rows(o.names, true, 20), anchor: "x2", domain: [0, 0.42]}}),
        shapes: [
          {...upright(1), yref: "y domain"}, {...upright(step.gap, "dash", "ink"), yref: "y domain"},
          {...upright(DATA.convincing, "dot", "warn"), xref: "x2", yref: tight ? "y2 domain" : "y domain"},
        ],
      }];
    });
  });

  const falls = DATA.falls;
  draw("falls-plot", () => {
    const looks = [{name: "fitted data", color: PALETTE[0], offset: -0.38}, {name: "other data", color: PALETTE[1], offset: 0.02}];
    return [looks.map(({name, color: shade, offset}, side) => ({
      type: "bar", orientation: "h", name, base: falls.begin[side], x: falls.end[side].map((v, i) => v === null ? null : v - falls.begin[side][i]), y: falls.labels.map((_, i) => i), width: 0.36, offset,
      text: falls.end[side].map(v => v === null ? "" : v.toPrecision(4)), textposition: "outside", cliponaxis: false, textfont: {size: 11.5, color: color("ink")}, constraintext: "none",
      marker: {color: shade, opacity: falls.whole.map(whole => whole ? 1 : 0.5)}, customdata: falls.labels.map((label, i) => [label, falls.end[side][i]]), hovertemplate: "%{customdata[0]}: gap %{customdata[1]:.4g}",
    })), {
      height: 120 + 52 * falls.labels.length, margin: {l: narrow("falls-plot") ? 130 : 250, r: 50, t: 40, b: 48}, barmode: "overlay", legend: {orientation: "h", x: 0, y: 1, yanchor: "bottom"},
      xaxis: gapAxis(falls.wide, [...falls.begin.flat(), ...falls.end.flat()], ...(narrow("falls-plot") ? [0.6, 0.6] : [0.25])), yaxis: rows(falls.labels, true, narrow("falls-plot") ? 20 : 42), shapes: [upright(1)],
    }];
  });

  const {bands, channels, reach, sets} = DATA.maps;
  const top = Math.log10(reach), ticks = [0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4, 10, 30, 100].filter(t => Math.abs(Math.log10(t)) <= top + 1e-9);
  const gapColors = showscale => ({
    showscale, colorscale: [[0, color("cold")], [0.25, color("cool")], [0.5, color("neutral")], [0.75, color("warm")], [1, color("hot")]],
    colorbar: colorBar("Gap", {tickvals: ticks.map(Math.log10), ticktext: ticks.map(String)}),
  });
  const row = Math.min(14, 780 / channels.length), every = Math.ceil(12 / row);
  const shown = channels.map((_, i) => i).filter(i => i % every === 0);
  sets.forEach(({maps}, k) => draw(`map-${k}`, () => [maps.map((map, side) => ({
    type: "heatmap", x: bands, y: channels.map((_, i) => i), z: map.gap.map(line => line.map(v => v === null ? null : Math.log10(Math.max(v, 1e-6)))), zmin: -top, zmax: top, name: map.label,
    ...gapColors(side === maps.length - 1), xaxis: side ? "x2" : "x",
    text: channels.map(name => bands.slice(1).map((high, b) => `${name}, ${bands[b].toPrecision(3)} to ${high.toPrecision(3)} Hz`)), customdata: map.gap, hovertemplate: "%{text}: gap %{customdata:.3g}",
  })), {
    height: Math.max(220, 100 + row * channels.length), margin: {l: 90, r: 16, t: 30, b: 48},
    ...Object.fromEntries(maps.map((_, side) => [side ? "xaxis2" : "xaxis", {
      ...decades(bands[0], bands.at(-1), narrow(`map-${k}`) ? "Hz" : "Frequency (Hz)"), domain: maps.length > 1 ? [side * 0.52, 0.48 + side * 0.52] : [0, 1], showgrid: false,
    }])),
    yaxis: {title: {text: "Response channel"}, tickmode: "array", tickvals: shown, ticktext: shown.map(i => channels[i]), tickfont: {size: 10.5}, range: [channels.length - 0.5, -0.5], showgrid: false, zeroline: false},
    annotations: maps.map((map, side) => ({text: map.label, showarrow: false, xref: "paper", yref: "paper", x: side * 0.52, xanchor: "left", y: 1, yanchor: "bottom", font: {size: 13}})),
  }]));

  const r = DATA.robot;
  if ($("gap-robot")) draw("gap-robot", () => {
    const tight = narrow("gap-robot"), last = r.gaps.length - 1, axis = side => side ? String(side + 1) : "";
    const known = gap => gap.map((v, i) => v === null ? -1 : i).filter(i => i >= 0), pick = (list, chosen) => chosen.map(i => list[i]);
    return [r.gaps.flatMap(({label, gap}, side) => {
      const on = {xaxis: `x${axis(side)}`, yaxis: `y${axis(side)}`, showlegend: false}, chosen = known(gap);
      return [
        {...on, x: r.skeleton[0], y: r.skeleton[1], mode: "lines+markers", line: {color: color("muted"), width: 4}, marker: {size: 7, color: color("sheet"), line: {color: color("muted"), width: 1.5}}, hoverinfo: "skip"},
        {...on, x: r.marks[0], y: r.marks[1], text: r.said, mode: "markers", marker: {size: 26, symbol: "circle-open", color: PALETTE[1], line: {width: 2.5}}, hovertemplate: "%{text}<extra></extra>"},
        {
          ...on, x: pick(r.points[0], chosen), y: pick(r.points[1], chosen), text: pick(r.names, chosen), customdata: pick(gap, chosen), mode: "markers", hovertemplate: `%{text}: gap %{customdata:.3g}<extra>${label}</extra>`,
          marker: {
            size: 11, color: pick(gap, chosen).map(v => Math.log10(Math.max(v, 1e-6))), cmin: -top, cmax: top, line: {color: color("ink"), width: 1}, ...gapColors(side === last),
          },
        },
      ];
    }), {
      height: tight ? 380 * (last + 1) : 420, margin: {l: 10, r: 10, t: 30, b: 10}, hovermode: "closest",
      ...Object.fromEntries(r.gaps.flatMap((_, side) => {
        const part = [side / (last + 1), (side + 0.94) / (last + 1)];
        return [
          [`xaxis${axis(side)}`, {visible: false, domain: tight ? [0, 1] : part, anchor: `y${axis(side)}`}],
          [`yaxis${axis(side)}`, {visible: false, domain: tight ? part.map(v => 1 - v).reverse() : [0, 1], anchor: `x${axis(side)}`, scaleanchor: `x${axis(side)}`}],
        ];
      })),
      annotations: r.gaps.flatMap(({label}, side) => [
        {text: label, showarrow: false, xref: `x${axis(side)} domain`, yref: `y${axis(side)} domain`, x: 0, xanchor: "left", y: 1, yanchor: "bottom", font: {size: 13}},
        ...r.arrows.map(([from, to]) => ({x: to[0], y: to[1], ax: from[0], ay: from[1], xref: `x${axis(side)}`, yref: `y${axis(side)}`, axref: `x${axis(side)}`, ayref: `y${axis(side)}`, text: "", showarrow: true, arrowhead: 2, arrowwidth: 2, arrowcolor: PALETTE[1]})),
      ]),
    }];
  });
})();
