// Error against images, machine time or compute time: a chart on the first screen and one per group, with common
// controls and a legend. Charts are specifications (chart.js) of the curves in the data, by the chosen view.
'use strict';

const relignCurves = (() => {
  const {byId, make, svg, options, known, number} = relign;
  const FEW_METHODS = 6;  // with bands at first
  const FIRST = [12, 400];  // methods in the chart of the first screen, and its height
  const DRAWN_AT_ONCE = 12, NEAR_PX = 600;  // distance from the viewport
  const TRACKS = [
    ['recommended', 'error at the recommended pose'],
    ['commanded', 'error at the commanded pose'],
    ['best', 'lowest measured error so far'],  // ranks stations: their first track
    ['measured', 'measured error (with noise)'],
    ['excess', 'excess error, above the optimum'],
    ['recommended_best', 'error at the pose with the lowest measured error'],
    ['recommended_current', 'error at the current pose'],
  ];
  const NOISE_FREE = ['recommended', 'commanded', 'recommended_best', 'recommended_current'];  // tracks to which floor and spec apply
  const CLOCKS = [['step', 'images'], ['machine_seconds', 'machine time, s'], ['algorithm_seconds', 'compute time, s']];
  const BANDS = [['interval', '95 % intervals', 'lo95', 'hi95'], ['quartiles', 'quartiles', 'q25', 'q75']];

  // A name may denote different methods under different protocols.
  const curveIn = (group, method) => (method.protocol && method.protocol !== group.protocol ? undefined
    : group.curves.find((curve) => curve.method === method.name));
  const counted = (group) => group.counted || 'image';
  const stepAt = (curve, i) => (curve.steps ? curve.steps[i] : curve.first_step + i);

  // Of equal tracks one is written, and intervals at their steps (`at`) only (curve_data.cpp).
  function expand(data) {
    for (const {tracks, at} of data.groups.flatMap((group) => group.curves))
      for (const [name, track] of Object.entries(tracks)) {
        if (typeof track === 'string') tracks[name] = tracks[track];
        else for (const key of ['lo95', 'hi95']) if (track[key]) track[key] = track.median.map((_, i) => { const k = (at || []).indexOf(i); return k < 0 ? null : track[key][k]; });
      }
  }

  // Intervals are computed at some steps only and interpolated between them, linearly in the chart's scale.
  function joined(values, log) {
    const places = values.map((value, i) => i).filter((i) => values[i] !== null);
    return values.map((value, i) => {
      const after = places.find((k) => k > i), before = places.filter((k) => k < i).pop();
      if (value !== null || after === undefined || before === undefined) return value;
      const share = (i - before) / (after - before), a = values[before], b = values[after];
      return log && a > 0 && b > 0 ? Math.exp(Math.log(a) + share * Math.log(b / a)) : a + share * (b - a);
    });
  }

  // view: {track, clock, log, logx, bands, visible: [bool]}
  function chartOf(data, group, view, most = Infinity, height = 300) {
    const series = [], axis = TRACKS.find(([id]) => id === view.track)[1];
    data.methods.forEach((method, index) => {
      const curve = curveIn(group, method), track = curve && curve.tracks[view.track];
      if (!track || !view.visible[index]) return;
      const band = BANDS.find(([id, , low]) => id === view.bands && track[low]);
      const [lows, highs] = band ? [joined(track[band[2]], view.log), joined(track[band[3]], view.log)] : [[], []];
      const one = {name: method.name, style: method.style, drawn: 'line', x: [], y: [], low: [], high: [], places: [], index, group, curve};
      track.median.forEach((y, place) => {
        const x = view.clock === 'step' ? stepAt(curve, place) : (curve[view.clock] || [])[place];
        if (!known(y) || !known(x) || (view.logx && !(x > 0)) || (view.log && !(y > 0))) return;
        for (const [list, value] of [['x', x], ['y', y], ['low', lows[place]], ['high', highs[place]], ['places', place]]) one[list].push(value);
      });
      if (one.x.length > 0) series.push(one);
    });
    series.sort((a, b) => a.y[a.y.length - 1] - b.y[b.y.length - 1]);  // labels: best first
    const floor = group.floor || {};
    const levels = !NOISE_FREE.includes(view.track) ? []
      : [['specification', group.spec, false], ['optimum', floor.own_optimum, false], ['bound of one more image', floor.next_image, true]]
        .filter(([, y]) => known(y) && (!view.log || y > 0)).map(([label, y, dotted]) => ({label, y, dotted}));
    return {title: group.label, height, series: series.slice(0, most), levels, y: {title: group.score ? axis + ', ' + group.score : axis, log: view.log},
            x: {title: view.clock === 'step' ? counted(group) + 's' : CLOCKS.find(([id]) => id === view.clock)[1], log: view.logx, whole: view.clock === 'step'}};
  }

  // The readout: a name and its values.
  function description(methods, view, {group, curve, index, places}, k) {
    const place = places[k], track = curve.tracks[view.track];
    const range = (words, low, high) => (low && known(low[place]) ? `; ${words} ${number(low[place])}\u2013${number(high[place])}` : '');
    const seconds = (key, words) => (curve[key] && known(curve[key][place]) ? `; ${number(curve[key][place])} s ${words}` : '');
    return [methods[index].label || methods[index].name, ` ${counted(group)} ${stepAt(curve, place)}: ${number(track.median[place])}` +
      range('95 %', track.lo95, track.hi95) + range('quartiles', track.q25, track.q75) + seconds('machine_seconds', 'machine time') +
      seconds('algorithm_seconds', 'compute time') + `; ${curve.trials === 1 ? '1 instance' : curve.trials + ' instances'}`];
  }

  function draw(place, data, group, view, more = []) {
    const chart = new relignChart.Chart(place, chartOf(data, group, view, ...more), {
      name: 'error-' + group.label, describe: (i, k) => description(data.methods, view, chart.spec.series[i], k)});
    return chart;
  }

  const hasCurves = (group) => group.curves.some((curve) => Object.keys(curve.tracks).length > 0);

  // The chart beside the table of the verdict.
  function first(data, view) {
    const shown = data.groups.map((group, i) => i).filter((i) => hasCurves(data.groups[i])), select = byId('first-group');
    if (!byId('first-chart') || shown.length === 0) return;
    select.replaceChildren(...options(shown.map((i) => [i, data.groups[i].label])));
    select.hidden = shown.length < 2;
    byId('first-figure').hidden = false;
    const own = {...view, visible: data.methods.map(() => true), bands: view.defaultBands};
    const [, words] = BANDS.find(([id]) => id === own.bands) || ['', ''];
    const chosen = () => data.groups[select.value], chart = draw(byId('first-chart'), data, chosen(), own, FIRST);
    const caption = () => { byId('first-caption').textContent = `Median over the instances after each ${counted(chosen())}${words ? ', with ' + words : ''}.`; };
    caption();
    select.addEventListener('change', () => { chart.name = 'error-' + chosen().label; caption(); chart.set(chartOf(data, chosen(), own, ...FIRST)); });
  }

  function start(data) {
    const methods = data.methods;
    if (methods.length === 0) {
      byId('curves-problem').hidden = false;
      byId('curves-problem').textContent = 'No trial finished, so there are no curves.';
      byId('cards').hidden = true;
      return 0;
    }
    const everyCurve = data.groups.flatMap((group) => group.curves);
    const has = (key) => everyCurve.some((curve) => Object.values(curve.tracks).some((track) => (track[key] || []).some(known)));
    const bands = [...BANDS.filter(([, , low]) => has(low)), ['none', 'no bands']];
    const view = {track: data.track, clock: 'step', log: !data.groups.some((group) => group.linear), logx: false, visible: methods.map(() => true), defaultBands: bands[0][0],
                  bands: methods.length <= FEW_METHODS ? bands[0][0] : 'none'};
    byId('scale').value = view.log ? 'log' : 'linear';
    const charts = new Map();  // card element -> Chart, once drawn
    const groupOf = (card) => data.groups[card.id.slice('group-'.length)];
    const cards = [...document.querySelectorAll('.card')], legend = byId('legend');
    const updateAll = (keepZoom) => { for (const [card, chart] of charts) chart.set(chartOf(data, groupOf(card), view), keepZoom); };

    function drawCard(card) {
      if (charts.has(card)) return;
      const group = groupOf(card), place = card.querySelector('.chart');
      place.classList.remove('waiting');
      if (hasCurves(group)) charts.set(card, draw(place, data, group, view));
      else place.textContent = 'No trial finished in this group.';
      document.documentElement.dataset.curves = String(charts.size);
    }

    function fillLegend() {
      legend.replaceChildren(...methods.map((method, i) => {
        const box = make('input', {type: 'checkbox', checked: view.visible[i]});
        box.addEventListener('change', () => { view.visible[i] = box.checked; updateAll(true); });
        const swatch = svg('svg', {class: relignChart.classOf(method.style), width: 30, height: 10},
          svg('line', {x1: 0, x2: 30, y1: 5, y2: 5, 'stroke-width': '2.5', stroke: 'currentColor', 'stroke-dasharray': relignChart.dashOf(method.style)}));
        const item = make('li', {}, make('label', {}, box, swatch, make('bdi', {textContent: method.label || method.name}), method.oracle ? ' (oracle)' : ''));
        const light = (on) => { for (const chart of charts.values()) { const place = chart.spec.series.findIndex((one) => one.index === i); chart.highlight(on && place >= 0 ? place : null); } };
        item.addEventListener('mouseenter', () => light(true));
        item.addEventListener('mouseleave', () => light(false));
        return item;
      }));
    }

    const present = TRACKS.filter(([id]) => everyCurve.some((curve) => curve.tracks[id]));
    if (!present.some(([id]) => id === view.track)) view.track = present[0][0];
    const steps = data.groups.every((group) => counted(group) === 'image') ? 'images' : 'moves';
    const clocks = CLOCKS.filter(([key]) => key === 'step' || everyCurve.some((curve) => curve[key]))
      .map(([key, words]) => [key, key === 'step' ? steps : words]);
    const control = (id, list, key, of = (value) => value) => {
      if (list) byId(id).replaceChildren(...options(list));
      if (list) byId(id).value = view[key];
      byId(id).addEventListener('change', (event) => { view[key] = of(event.target.value); updateAll(false); });
    };
    control('track', present, 'track');
    control('bands', bands, 'bands');
    control('clock', clocks, 'clock');
    byId('clock').parentElement.hidden = clocks.length < 2;
    control('scale', null, 'log', (value) => value === 'log');
    control('xscale', null, 'logx', (value) => value === 'log');
    const showEvery = (visible) => { view.visible.fill(visible); fillLegend(); updateAll(true); };
    byId('all').addEventListener('click', () => showEvery(true));
    byId('none').addEventListener('click', () => showEvery(false));
    for (const id of ['controls', 'legend', 'curves-help']) byId(id).hidden = false;
    fillLegend();
    first(data, view);

    let waiting = cards;
    const drawNear = () => {
      waiting = waiting.filter((card) => {
        const box = card.getBoundingClientRect(), near = box.top < window.innerHeight + NEAR_PX && box.bottom > -NEAR_PX;
        if (near) drawCard(card);
        return !near;
      });
    };
    if (cards.length <= DRAWN_AT_ONCE) {
      cards.forEach(drawCard);
    } else {
      for (const card of cards) card.querySelector('.chart').classList.add('waiting');
      for (const what of ['scroll', 'resize']) window.addEventListener(what, drawNear, {passive: true});
      drawNear();
    }
    window.addEventListener('beforeprint', () => cards.forEach(drawCard));
    return charts.size;
  }

  return {start, expand};
})();
